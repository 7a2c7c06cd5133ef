"""Memory of a program: one slot per scalar, in it one number per lane."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from simdjit.instructions import SLOT

_CACHE_LINE = 64


class Layout:
    """Arrays of many runs as slots of groups of lanes.

    Args:
        leaves: shapes and types of the arrays of one run.
        lanes: runs of a group.
    """

    def __init__(self, leaves: Sequence[Any], lanes: int):
        self._shapes = [tuple(leaf.shape) for leaf in leaves]
        self._types = [np.dtype(leaf.dtype) for leaf in leaves]
        sizes = [int(np.prod(shape)) for shape in self._shapes]
        self._firsts = np.cumsum([0, *sizes]).tolist()
        self._lanes = lanes

    def memory(self, groups: int, rows: int = 1) -> np.ndarray:
        """Room for some groups, each with some rows of all slots; bytes, (groups, rows, slots, bytes of a slot)."""
        shape = (groups, rows, self._firsts[-1], SLOT * self._lanes)
        raw = np.zeros(int(np.prod(shape)) + _CACHE_LINE, dtype=np.uint8)
        start = -raw.ctypes.data % _CACHE_LINE
        return raw[start : start + int(np.prod(shape))].reshape(shape)

    def packed(self, arrays: Sequence[Any], runs: int) -> np.ndarray:
        """Arrays with a leading axis over runs in their slots; lanes without a run get the last one."""
        groups = -(-runs // self._lanes)
        memory = self.memory(groups)
        which = np.minimum(np.arange(groups * self._lanes), runs - 1).reshape(groups, self._lanes)
        for i, array in enumerate(arrays):
            rows = np.asarray(array).reshape(runs, self._firsts[i + 1] - self._firsts[i])[which]
            self._slots(memory, i)[:, 0] = rows.transpose(0, 2, 1)
        return memory

    def unpacked(self, memory: np.ndarray, runs: int) -> list[np.ndarray]:
        """Arrays, axes over runs and rows first."""
        arrays = []
        for i, (shape, kind) in enumerate(zip(self._shapes, self._types, strict=True)):
            lanes_last = self._slots(memory, i)
            rows = np.moveaxis(lanes_last, -1, 1).reshape(len(memory) * self._lanes, memory.shape[1], *shape)
            arrays.append(rows[:runs].astype(kind, order="C"))
        return arrays

    def views(self, memory: np.ndarray) -> list[np.ndarray]:
        """The arrays of the first run themselves, not copies: writing into them writes into the memory."""
        return [self._slots(memory, i)[0, 0, :, 0].reshape(shape) for i, shape in enumerate(self._shapes)]

    def views_of_groups(self, memory: np.ndarray) -> list[np.ndarray]:
        """The arrays of all runs themselves, (groups, lanes, ...): writing into them writes into the memory."""
        slots = [np.moveaxis(self._slots(memory, i)[:, 0], 1, 2) for i in range(len(self._shapes))]
        return [some.reshape(*some.shape[:2], *shape) for some, shape in zip(slots, self._shapes, strict=True)]

    def _slots(self, memory: np.ndarray, i: int) -> np.ndarray:
        """Slots of one array as numbers, (groups, rows, slots, lanes); truths are whole numbers there."""
        kind = np.dtype(np.int64) if self._types[i].kind == "b" else self._types[i]
        some = memory[:, :, self._firsts[i] : self._firsts[i + 1]]
        return some.view(kind)[..., : self._lanes]
