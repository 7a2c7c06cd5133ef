"""A function with a leading axis over runs, by XLA: for what has no rule."""

from collections.abc import Callable
from typing import Any

import jax
import numpy as np

from simdjit.graph import Unsupported
from simdjit.portable import PortableProgram

# The width of a program decides about the last bits of a result, what is in the other places does not: every program
# has this width, however few runs there are, so that no result depends on how they are cut into tasks.
_WIDTH = 64


class XlaProgram:
    """A function for many runs, by `jax.vmap`.

    Args:
        function: of a list of arrays of one run, giving such a list.
        example: of its arguments.
        portable: whether it will be pickled, for another process.
    """

    def __init__(self, function: Callable[[list[Any]], list[Any]], example: list[Any], portable: bool = False):
        stacked = [jax.ShapeDtypeStruct((_WIDTH, *np.shape(leaf)), leaf.dtype) for leaf in example]
        runs = jax.vmap(function)
        self._program = PortableProgram(runs, stacked) if portable else jax.jit(runs).lower(stacked).compile()
        self._last: tuple[list[bytes], list[np.ndarray]] | None = None

    def run(self, leaves: list[np.ndarray]) -> list[np.ndarray]:
        """From arguments to results, each with a leading axis over runs."""
        if len(leaves[0]) > 1:
            return self._run(leaves)
        # A run that is repeated with other numbers of something else, as a slider does, needs the same once more.
        last, arguments = self._last, [np.asarray(leaf).tobytes() for leaf in leaves]
        if last is None or last[0] != arguments:
            last = self._last = arguments, self._run(leaves)
        return last[1]

    def _run(self, leaves: list[np.ndarray]) -> list[np.ndarray]:
        runs, pieces = len(leaves[0]), []
        for first in range(0, runs, _WIDTH):
            which = np.minimum(np.arange(first, first + _WIDTH), runs - 1)
            results = self._program([np.asarray(leaf)[which] for leaf in leaves])
            pieces.append([np.asarray(result) for result in results])
        return [np.concatenate(parts)[:runs] for parts in zip(*pieces, strict=True)]

    def __getstate__(self) -> PortableProgram:
        if not isinstance(self._program, PortableProgram):
            raise Unsupported("a program of XLA that was not made for other processes")
        return self._program

    def __setstate__(self, program: PortableProgram) -> None:
        self._program, self._last = program, None
