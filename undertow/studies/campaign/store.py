"""Where the results of a campaign stand: one zarr v3 store, a chunk of every array per task, its flag written last.

import xarray as xr
results = xr.open_zarr("runs/my-campaign/trials.zarr", consolidated=False)
"""

import contextlib
import os
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from undertow.core.errors import BadInput
from undertow.studies.campaign.columns import Label
from undertow.studies.campaign.identity import Identity
from undertow.studies.campaign.lock import locked

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
        identity: of the campaign; a store that is there must be of the same.
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
        identity: Identity,
        labels: Mapping[str, Label],
        coordinates: Mapping[str, xr.Variable],
    ):
        self._path, self._trials, self._chunk, self._labels = path, trials, chunk, labels
        path.mkdir(parents=True, exist_ok=True)
        with contextlib.ExitStack() as held:
            held.callback(os.close, locked(path))
            self._open(identity, coordinates)
            self._held = held.pop_all()

    def _open(self, identity: Identity, coordinates: Mapping[str, xr.Variable]) -> None:
        """What is there of an earlier process, and what is not there yet."""
        for left in self._path.rglob("*.partial"):  # by a process that was killed while zarr wrote a file
            left.unlink()
        self._group = _opened(self._path)
        known = dict(self._group.attrs)
        if known:
            identity.check_same(known, self._path.parent)
            self._chunk = int(known["chunk"])
        if known.get("campaign") != identity.asked:
            # All at once, as no process can be killed between two of them.
            self._group.update_attributes({**identity.attributes, "campaign": identity.asked, "chunk": self._chunk})
        # Asking zarr for an array takes as long as writing it.
        found = {name: self._found(name) for name in (_DONE, *self._labels)}
        self._arrays = {name: array for name, array in found.items() if array is not None}
        for name, one in coordinates.items():  # always: a process may have been killed before their values stood there
            self._array(name, one.dtype, one.shape, one.shape, Label((name,), one.attrs))[:] = one.values
        if _DONE not in self._arrays:
            label = Label(("task",), {"long_name": "1 for what is written"})
            self._arrays[_DONE] = self._array(_DONE, np.dtype(np.uint8), (self.tasks,), (1,), label)

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
        self._held.close()

    def _whole(self, task: int) -> bool:
        first, last = self.rows(task).start, self.rows(task).stop
        try:
            for name in self._labels:
                array = self._arrays[name]
                array[first:last]
                chunk_file(self._path, name, task, array.ndim).stat()
        except Exception:  # whatever a codec says of a torn chunk; for one that is gone zarr has zeros
            return False
        return True

    def _found(self, name: str) -> Any:
        """An array of an earlier process; nothing where it is gone or cannot be read: it is made anew."""
        try:
            return self._group[name].with_config(_CONFIG)
        except (KeyError, ValueError):
            return None

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


def chunk_file(path: Path, name: str, task: int, dimensions: int = 1) -> Path:
    """Where zarr keeps the rows of a task in an array; of one that is gone it says that it is full of zeros."""
    return path.joinpath(name, "c", str(task), *["0"] * (dimensions - 1))


def _opened(path: Path) -> Any:
    """The group of a store.

    Raises:
        BadInput: what is there is none.
    """
    try:
        return zarr.open_group(path, mode="a")
    except Exception as error:  # whatever zarr says of metadata that is no JSON, or not of a group
        got, hint = f"{path.parent}: zarr.json is damaged ({error})", "--overwrite begins anew"
        raise BadInput("--out", "hold a store that can be read", got, hint=hint) from error
