"""Where the results of a campaign stand: one zarr v3 store, a chunk of every array per task, its flag written last.

import xarray as xr
results = xr.open_zarr("runs/my-campaign/trials.zarr", consolidated=False)
"""

import fcntl
import json
import os
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from undertow.analysis.meanings import MEANINGS
from undertow.core.errors import BadInput

try:
    import zarr
    from zarr.codecs import ZstdCodec
except ModuleNotFoundError:
    raise BadInput("campaign", "find zarr installed", "not", hint="pip install 'undertow[campaign]'") from None

_DONE = "done"

# Its checksum tells a chunk that was torn apart.
_CODEC = ZstdCodec(level=3, checksum=True)


class Store:
    """Rows of trials, written by tasks in any order.

    Args:
        path: folder of the store; made when missing.
        trials: number of rows.
        chunk: rows per task; a store that is there already keeps its own.
        attributes: of the store; plain data.

    Raises:
        BadInput: the folder belongs to another campaign, or another process is writing to it.
    """

    def __init__(self, path: Path, trials: int, chunk: int, attributes: Mapping[str, Any]):
        self._trials, self._chunk = trials, chunk
        path.mkdir(parents=True, exist_ok=True)
        self._lock = _locked(path)
        for left in path.rglob("*.partial"):  # by a process that was killed while zarr wrote a file
            left.unlink()
        self._group = zarr.open_group(path, mode="a")
        if _DONE in self._group:
            self._chunk = _same(dict(self._group.attrs), dict(attributes), path.parent)
        else:
            self._group.attrs.update({**attributes, "chunk": chunk})
            self._array(_DONE, np.uint8, (self.tasks,), (1,), ("task",), 0, {})

    @property
    def tasks(self) -> int:
        """How many there are."""
        return -(-self._trials // self._chunk)

    def rows(self, task: int) -> range:
        """Trials of a task."""
        return range(task * self._chunk, min((task + 1) * self._chunk, self._trials))

    def missing(self) -> list[int]:
        """Tasks to be done; those whose rows cannot be read are among them."""
        done = np.asarray(self._group[_DONE][:])
        return [task for task in range(self.tasks) if not (done[task] and self._whole(task))]

    def write(self, task: int, columns: Mapping[str, np.ndarray], notes: Mapping[str, Mapping[str, Any]]) -> None:
        """All rows of a task.

        Args:
            task: its number.
            columns: by name, one entry per row.
            notes: attributes of columns by name; used when a column is new.

        Raises:
            OSError: the disk is full, for example; the task then counts as not done.
        """
        first, last = self.rows(task).start, self.rows(task).stop
        for name, values in columns.items():
            if name not in self._group:
                shape, chunks = (self._trials, *values.shape[1:]), (self._chunk, *values.shape[1:])
                dimensions = ("trial", *(f"{name}_{i}" for i in range(1, values.ndim)))
                empty = np.nan if values.dtype.kind == "f" else 0
                told = {**notes.get(name, {}), **_meaning(name)}
                self._array(name, values.dtype, shape, chunks, dimensions, empty, told)
            self._group[name][first:last] = values
        self._group[_DONE][task] = 1

    def close(self) -> None:
        """Let others write."""
        os.close(self._lock)

    def _whole(self, task: int) -> bool:
        first, last = self.rows(task).start, self.rows(task).stop
        try:
            for _, array in self._group.arrays():
                if array.shape[0] == self._trials:
                    array[first:last]
        except Exception:  # whatever a codec says of a torn chunk
            return False
        return True

    def _array(
        self, name: str, dtype: Any, shape: tuple, chunks: tuple, dimensions: tuple, empty: Any, told: dict[str, Any]
    ) -> Any:
        # With its attributes at once: killed between the two, an array would stay without them.
        return self._group.create_array(
            name,
            shape=shape,
            chunks=chunks,
            dtype=dtype,
            fill_value=empty,
            dimension_names=dimensions,
            compressors=[_CODEC],
            attributes=told,
            config={"write_empty_chunks": True},
        )


def _same(found: dict[str, Any], wanted: dict[str, Any], folder: Path) -> int:
    """Rows per task of a store that may be gone on with."""
    chunk = found.pop("chunk")
    if found != json.loads(json.dumps(wanted)):
        other = [key for key in wanted if found.get(key) != wanted[key]]
        got, hint = (
            f"{folder}, where {', '.join(other)} differ",
            "Choose another folder, or begin anew with --overwrite",
        )
        raise BadInput("--out", "hold the same campaign, by the same versions", got, hint=hint)
    return int(chunk)


def _meaning(name: str) -> dict[str, str]:
    meaning = MEANINGS.get(name)
    return {"long_name": meaning.meaning, "units": meaning.unit or "1"} if meaning else {}


def _locked(path: Path) -> int:
    """A lock that goes with the process, however it ends."""
    handle = os.open(path.with_name(f".{path.name}.lock"), os.O_CREAT | os.O_RDWR)
    try:
        fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except OSError:
        os.close(handle)
        raise BadInput("--out", "be a folder that nothing else writes to", str(path.parent)) from None
    return handle
