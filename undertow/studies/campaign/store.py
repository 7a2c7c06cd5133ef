"""Results store of a campaign: one zarr v3 store, one chunk of every array per task, with the flag of the task last.

import xarray as xr
results = xr.open_zarr("runs/my-campaign/trials.zarr", consolidated=False)
"""

import contextlib
import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr
import zarr
from zarr.codecs import ZstdCodec
from zarr.storage import MemoryStore

from undertow.core.atomic_io import sync
from undertow.core.errors import BadInput
from undertow.core.file_lock import file_lock
from undertow.studies.campaign.columns import DONE, FLAGS, Label
from undertow.studies.campaign.fingerprint import Identity, samples
from undertow.studies.campaign.store_layout import StoreLayout

# The checksum reveals a chunk that was written only in part.
_CODEC = ZstdCodec(level=3, checksum=True)

# A chunk of zeros is written as a file too, so that a missing chunk is noticed.
_CONFIG: Any = {"write_empty_chunks": True}


def opened(path: Path) -> Any:
    """The group of a store, created if missing.

    Raises:
        BadInput: the store is damaged.
    """
    try:
        return zarr.open_group(path, mode="a")
    except Exception as error:  # whatever zarr says of metadata that is no JSON, or not of a group
        got = f"{path.parent}: zarr.json is damaged ({error})"
        hint = "Use --overwrite to start again"
        raise BadInput("--out", "hold a store that can be read", got, hint=hint) from error


def to_be_read(path: Path) -> Any:
    """The group of a store that another process may be writing to.

    Raises:
        FileNotFoundError: there is none.
    """
    return zarr.open_group(path, mode="r")


def found_array(group: Any, name: str) -> Any:
    """An array of an earlier process; None where it is missing or unreadable, and then created again."""
    try:
        return group[name].with_config(_CONFIG)
    except Exception:  # whatever zarr says of metadata that are none
        return None


def check_array(array: Any, label: Label, chunks: tuple[int, ...], path: Path) -> None:
    """Check that the metadata of an array are those it was created with: others would change the meaning of its chunks.

    Args:
        array: as found; its shape may have grown.
        label: what it must hold.
        chunks: size of a chunk along its first axes; along the others there is one.
        path: of the store, for messages.

    Raises:
        BadInput: the metadata differ.
    """
    chunks = (*chunks, *array.shape[len(chunks) :])
    expected_array = new_array(zarr.open_group(MemoryStore()), "made", array.shape, chunks, label)
    stored, expected = array.metadata.to_dict(), expected_array.metadata.to_dict()
    serialized = lambda value: json.dumps(value, sort_keys=True, default=str)
    differing = [key for key in expected | stored if serialized(stored.get(key)) != serialized(expected.get(key))]
    if differing:
        got = f"{path / array.basename / 'zarr.json'} with another {', '.join(differing)}"
        hint = f"Restore it, or remove {array.basename}/ and use --resume to compute it again"
        raise BadInput("--out", "hold a store as it was written", got, hint=hint)


def flags(array: Any, count: int) -> np.ndarray:
    """Which of the first tasks are done; a task whose flag cannot be read is not."""
    try:
        return np.asarray(array[:count]) != 0
    except Exception:  # whatever a codec says of a torn chunk: it is looked for
        done = np.zeros(count, dtype=bool)
        for task in range(count):
            with contextlib.suppress(Exception):
                done[task] = array[task] != 0
        return done


def new_array(group: Any, name: str, shape: tuple[int, ...], chunks: tuple[int, ...], label: Label) -> Any:
    """A new array of a group, replacing what a killed process may have left."""
    dtype = np.dtype(label.dtype)
    return group.create_array(
        name,
        shape=shape,
        chunks=chunks,
        dtype=str if dtype.kind == "U" else dtype,
        fill_value={"f": np.nan, "U": ""}.get(dtype.kind, 0),
        dimension_names=label.dimensions,
        compressors=[_CODEC],
        attributes=label.attributes,  # at once: killed between the two, an array would stay without them
        overwrite=True,
        config=_CONFIG,
    )


def chunk_file(path: Path, name: str, block: tuple[int, ...], dimensions: int) -> Path:
    """File of a block of an array; zarr reads a missing file as zeros."""
    return path.joinpath(name, "c", *map(str, block), *["0"] * (dimensions - len(block)))


class Store:
    """Rows of trials, written by tasks in any order.

    Args:
        path: folder of the store; created if missing.
        layout: layout of the trials; an existing store keeps its own blocks.
        identity: fingerprint of the campaign; an existing store must have the same, possibly with fewer samples.
        labels: labels of the columns, by name.
        coordinates: coordinates of the dimensions, by name.
        attributes: further ones of the store.

    Raises:
        BadInput: the folder belongs to another campaign, or another process is writing to it.
    """

    def __init__(
        self,
        path: Path,
        layout: StoreLayout,
        identity: Identity,
        labels: Mapping[str, Label],
        coordinates: Mapping[str, xr.Variable],
        attributes: Mapping[str, str],
    ):
        self.layout, self._path, self._labels = layout, path, labels
        path.mkdir(parents=True, exist_ok=True)
        with contextlib.ExitStack() as held:
            held.enter_context(file_lock(path))
            self._open(identity, coordinates, attributes)
            self._held = held.pop_all()

    def _open(self, identity: Identity, coordinates: Mapping[str, xr.Variable], attributes: Mapping[str, str]) -> None:
        """Open the arrays of an earlier process, and create the missing ones."""
        for partial_file in self._path.rglob("*.partial"):  # from a process killed while zarr wrote a file
            partial_file.unlink()
        self._group = opened(self._path)
        stored_attributes = dict(self._group.attrs)
        if stored_attributes:
            identity.check_same(stored_attributes, self._path.parent)
            self.layout = self.layout._replace(chunk=tuple(stored_attributes["chunk"]))
        # Asking zarr for an array takes as long as writing it.
        stored_arrays = {name: found_array(self._group, name) for name in (DONE, *self._labels)}
        self._arrays = {name: array for name, array in stored_arrays.items() if array is not None}
        for name, array in self._arrays.items():
            label, chunk = (FLAGS, (1,)) if name == DONE else (self._labels[name], self.layout.chunk)
            check_array(array, label, chunk, self._path)
        if stored_attributes:
            self._grow(samples(stored_attributes["campaign"]))
        if stored_attributes.get("campaign") != identity.asked:
            # In one write, so that no process is killed between two; and last, because growing may be interrupted.
            campaign_attributes = {"campaign": identity.asked, "chunk": list(self.layout.chunk)}
            self._group.update_attributes({**attributes, **identity.attributes, **campaign_attributes})
        # Always: an earlier process may have been killed before it wrote the values.
        for name, variable in coordinates.items():
            label = Label((name,), variable.attrs, variable.dtype.str)
            new_array(self._group, name, variable.shape, variable.shape, label)[:] = variable.values
        if DONE not in self._arrays:
            self._arrays[DONE] = new_array(self._group, DONE, (self.layout.tasks,), (1,), FLAGS)
        self._settle(*self._arrays, *coordinates)

    def _grow(self, before: int) -> None:
        """Make room for more samples."""
        if DONE in self._arrays and before < self.layout.samples:
            for task in self.layout._replace(samples=before).partial():
                self._arrays[DONE][task] = 0
        for name, array in self._arrays.items():
            leading = (self.layout.tasks,) if name == DONE else self.layout.shape
            shape = (*leading, *array.shape[len(leading) :])
            if array.shape != shape:
                array.resize(shape)

    def missing(self) -> list[int]:
        """Tasks to run, including those whose rows cannot be read."""
        done = flags(self._arrays[DONE], self.layout.tasks)
        return [task for task in range(self.layout.tasks) if not (done[task] and self._whole(task))]

    def write(self, task: int, columns: Mapping[str, np.ndarray]) -> None:
        """Write all rows of a task: columns by name, with one entry per trial.

        Raises:
            OSError: for example, the disk is full; the task then counts as not done.
        """
        region = self.layout.region(task)
        block_shape = [span.stop - span.start for span in region]
        for name, values in columns.items():
            trial_shape = values.shape[1:]
            if name not in self._arrays:
                shape, chunks = (*self.layout.shape, *trial_shape), (*self.layout.chunk, *trial_shape)
                self._arrays[name] = new_array(self._group, name, shape, chunks, self._labels[name])
                self._settle(name)
            self._arrays[name][region] = values.reshape(*block_shape, *trial_shape)
        self._arrays[DONE][task] = 1

    def close(self) -> None:
        """Release the lock."""
        self._held.close()

    def _settle(self, *names: str) -> None:
        """Flush the metadata of arrays to disk: without them all chunks are lost.

        A damaged chunk can be computed again.
        """
        for folder in (*(self._path / name for name in names), self._path):
            sync(folder / "zarr.json")
            sync(folder)

    def _whole(self, task: int) -> bool:
        region, block = self.layout.region(task), self.layout.block(task)
        try:
            for name in self._labels:
                array = self._arrays[name]
                array[region]
                chunk_file(self._path, name, block, array.ndim).stat()
        except Exception:  # a codec raises many kinds of errors for a damaged chunk; zarr reads a missing one as zeros
            return False
        return True
