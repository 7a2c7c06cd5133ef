"""Where the results of a campaign stand: one zarr v3 store, a chunk of every array per task, its flag written last.

import xarray as xr
results = xr.open_zarr("runs/my-campaign/trials.zarr", consolidated=False)
"""

import fcntl
import os
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from undertow.core.errors import BadInput
from undertow.studies.campaign.columns import Label

try:
    import zarr
    from zarr.codecs import ZstdCodec
except ModuleNotFoundError:
    raise BadInput("campaign", "find zarr installed", "not", hint="pip install 'undertow[campaign]'") from None

_DONE = "done"

# Its checksum tells a chunk that was torn apart.
_CODEC = ZstdCodec(level=3, checksum=True)

# A chunk of nothing but zeros is a file, too: one that is gone is noticed.
_CONFIG: Any = {"write_empty_chunks": True}


class Store:
    """Rows of trials, written by tasks in any order.

    Args:
        path: folder of the store; made when missing.
        trials: number of rows.
        chunk: rows per task; a store that is there already keeps its own.
        identity: attributes that are the same in a store that may be gone on with; plain data.
        further: other attributes, those of whoever wrote last.
        labels: of columns by name.
        coordinates: along other dimensions than that of trials, by name.

    Raises:
        BadInput: the folder belongs to another campaign, or another process is writing to it.
    """

    def __init__(
        self,
        path: Path,
        trials: int,
        chunk: int,
        identity: Mapping[str, Any],
        further: Mapping[str, Any],
        labels: Mapping[str, Label],
        coordinates: Mapping[str, xr.Variable],
    ):
        self._path, self._trials, self._chunk, self._labels = path, trials, chunk, labels
        path.mkdir(parents=True, exist_ok=True)
        self._lock = _locked(path)
        for left in path.rglob("*.partial"):  # by a process that was killed while zarr wrote a file
            left.unlink()
        self._group = zarr.open_group(path, mode="a")
        if _DONE in self._group:
            self._chunk = _same(dict(self._group.attrs), identity, path.parent)
            if any(self._group.attrs[key] != value for key, value in further.items()):
                self._group.attrs.update(further)
        else:
            self._group.attrs.update({**identity, **further, "chunk": chunk})
            for name, one in coordinates.items():
                self._array(name, one.dtype, one.shape, one.shape, Label((name,), one.attrs))[:] = one.values
            label = Label(("task",), {"long_name": "1 for what is written"})
            self._array(_DONE, np.dtype(np.uint8), (self.tasks,), (1,), label)
        # Asking zarr for an array takes as long as writing it.
        self._arrays = {name: array.with_config(_CONFIG) for name, array in self._group.arrays()}

    @property
    def tasks(self) -> int:
        """How many there are."""
        return -(-self._trials // self._chunk)

    def rows(self, task: int) -> range:
        """Trials of a task."""
        return range(task * self._chunk, min((task + 1) * self._chunk, self._trials))

    def missing(self) -> list[int]:
        """Tasks to be done; those whose rows cannot be read are among them."""
        done = np.asarray(self._arrays[_DONE][:])
        return [task for task in range(self.tasks) if not (done[task] and self._whole(task))]

    def write(self, task: int, columns: Mapping[str, np.ndarray]) -> None:
        """All rows of a task.

        Args:
            task: its number.
            columns: by name, one entry per row.

        Raises:
            OSError: the disk is full, for example; the task then counts as not done.
        """
        first, last = self.rows(task).start, self.rows(task).stop
        for name, values in columns.items():
            if name not in self._arrays:
                shape, chunks = (self._trials, *values.shape[1:]), (self._chunk, *values.shape[1:])
                self._arrays[name] = self._array(name, values.dtype, shape, chunks, self._labels[name])
            self._arrays[name][first:last] = values
        self._arrays[_DONE][task] = 1

    def close(self) -> None:
        """Let others write."""
        os.close(self._lock)

    def _whole(self, task: int) -> bool:
        first, last = self.rows(task).start, self.rows(task).stop
        try:
            for name, array in self._arrays.items():
                if name in self._labels:
                    array[first:last]
                    self._path.joinpath(name, "c", str(task), *["0"] * (array.ndim - 1)).stat()
        except Exception:  # whatever a codec says of a torn chunk; for one that is gone zarr has zeros
            return False
        return True

    def _array(self, name: str, dtype: np.dtype, shape: tuple, chunks: tuple, label: Label) -> Any:
        # With its attributes at once: killed between the two, an array would stay without them. What a killed process
        # left of it is overwritten.
        return self._group.create_array(
            name,
            shape=shape,
            chunks=chunks,
            dtype=str if dtype.kind == "U" else dtype,
            fill_value={"f": np.nan, "U": ""}.get(dtype.kind, 0),
            dimension_names=label.dimensions,
            compressors=[_CODEC],
            attributes=label.attributes,
            overwrite=True,
            config=_CONFIG,
        )


def check_free(path: Path) -> None:
    """That no process is writing to a store.

    Raises:
        BadInput: one is.
    """
    os.close(_locked(path))


def _same(found: Mapping[str, Any], wanted: Mapping[str, Any], folder: Path) -> int:
    """Rows per task of a store that may be gone on with."""
    other = [key for key in wanted if found.get(key) != wanted[key]]
    if other:
        got = f"{folder}, with another {', '.join(key.removesuffix('_hash') for key in other)}"
        hint = "Choose another folder, or begin anew with --overwrite"
        raise BadInput("--out", "hold the same campaign, by the same versions", got, hint=hint)
    return int(found["chunk"])


def _locked(path: Path) -> int:
    """A lock that goes with the process, however it ends."""
    handle = os.open(path.with_name(f".{path.name}.lock"), os.O_CREAT | os.O_RDWR)
    try:
        fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except OSError:
        os.close(handle)
        raise BadInput("--out", "be a folder that nothing else writes to", str(path.parent)) from None
    return handle
