"""Where the results of a campaign stand: one zarr v3 store, a chunk of every array per task, its flag written last.

import xarray as xr
results = xr.open_zarr("runs/my-campaign/trials.zarr", consolidated=False)
"""

import contextlib
from collections.abc import Mapping
from pathlib import Path

import numpy as np
import xarray as xr

from undertow.campaign.arrays import check_array, chunk_file, flags, found_array, new_array, opened
from undertow.campaign.columns import DONE, FLAGS, Label
from undertow.campaign.fingerprint import Identity, draws
from undertow.campaign.layout import Layout
from undertow.core.disk import alone, sync


class Store:
    """Rows of trials, written by tasks in any order.

    Args:
        path: folder of the store; made when missing.
        layout: of the trials; a store that is there already keeps its own blocks.
        identity: of the campaign; a store that is there must be of the same, or of the same with fewer draws.
        labels: of columns by name.
        coordinates: along dimensions, by name.
        attributes: further ones of the store.

    Raises:
        BadInput: the folder belongs to another campaign, or another process is writing to it.
    """

    def __init__(
        self,
        path: Path,
        layout: Layout,
        identity: Identity,
        labels: Mapping[str, Label],
        coordinates: Mapping[str, xr.Variable],
        attributes: Mapping[str, str],
    ):
        self.layout, self._path, self._labels = layout, path, labels
        path.mkdir(parents=True, exist_ok=True)
        with contextlib.ExitStack() as held:
            held.enter_context(alone(path))
            self._open(identity, coordinates, attributes)
            self._held = held.pop_all()

    def _open(self, identity: Identity, coordinates: Mapping[str, xr.Variable], attributes: Mapping[str, str]) -> None:
        """What is there of an earlier process, and what is not there yet."""
        for left in self._path.rglob("*.partial"):  # by a process that was killed while zarr wrote a file
            left.unlink()
        self._group = opened(self._path)
        known = dict(self._group.attrs)
        if known:
            identity.check_same(known, self._path.parent)
            self.layout = self.layout._replace(chunk=tuple(known["chunk"]))
        # Asking zarr for an array takes as long as writing it.
        found = {name: found_array(self._group, name) for name in (DONE, *self._labels)}
        self._arrays = {name: array for name, array in found.items() if array is not None}
        for name, array in self._arrays.items():
            label, chunk = (FLAGS, (1,)) if name == DONE else (self._labels[name], self.layout.chunk)
            check_array(array, label, chunk, self._path)
        if known:
            self._grow(draws(known["campaign"]))
        if known.get("campaign") != identity.asked:
            # All at once, as no process can be killed between two of them; and last, as a growth may be cut short.
            asked = {"campaign": identity.asked, "chunk": list(self.layout.chunk)}
            self._group.update_attributes({**attributes, **identity.attributes, **asked})
        for name, one in coordinates.items():  # always: a process may have been killed before their values stood there
            label = Label((name,), one.attrs, one.dtype.str)
            new_array(self._group, name, one.shape, one.shape, label)[:] = one.values
        if DONE not in self._arrays:
            self._arrays[DONE] = new_array(self._group, DONE, (self.layout.tasks,), (1,), FLAGS)
        self._settle(*self._arrays, *coordinates)

    def _grow(self, before: int) -> None:
        """Make room for further draws."""
        if DONE in self._arrays and before < self.layout.draws:
            for task in self.layout._replace(draws=before).partial():
                self._arrays[DONE][task] = 0
        for name, array in self._arrays.items():
            own = (self.layout.tasks,) if name == DONE else self.layout.shape
            shape = (*own, *array.shape[len(own) :])
            if array.shape != shape:
                array.resize(shape)

    def missing(self) -> list[int]:
        """Tasks to be done; those whose rows cannot be read are among them."""
        done = flags(self._arrays[DONE], self.layout.tasks)
        return [task for task in range(self.layout.tasks) if not (done[task] and self._whole(task))]

    def write(self, task: int, columns: Mapping[str, np.ndarray]) -> None:
        """All rows of a task.

        Args:
            task: its number.
            columns: by name, one entry per trial.

        Raises:
            OSError: the disk is full, for example; the task then counts as not done.
        """
        region = self.layout.region(task)
        covered = [one.stop - one.start for one in region]
        for name, values in columns.items():
            each = values.shape[1:]
            if name not in self._arrays:
                shape, chunks = (*self.layout.shape, *each), (*self.layout.chunk, *each)
                self._arrays[name] = new_array(self._group, name, shape, chunks, self._labels[name])
                self._settle(name)
            self._arrays[name][region] = values.reshape(*covered, *each)
        self._arrays[DONE][task] = 1

    def close(self) -> None:
        """Let others write."""
        self._held.close()

    def _settle(self, *names: str) -> None:
        """Put the metadata of arrays on the disk: without them all is lost; a torn chunk is noticed and made again."""
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
        except Exception:  # whatever a codec says of a torn chunk; for one that is gone zarr has zeros
            return False
        return True
