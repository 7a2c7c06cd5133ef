"""The results of a campaign as they stand in its store."""

import itertools
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import xarray as xr

from undertow.analysis.meanings import MEANINGS
from undertow.core.status import Status
from undertow.studies.campaign.conduct import STORE
from undertow.studies.campaign.reading import read_text
from undertow.studies.campaign.schema import Campaign
from undertow.studies.campaign.task import REFUSED


class Results(NamedTuple):
    """A campaign's rows, and what they were asked for."""

    campaign: Campaign
    rows: xr.Dataset  # of the tasks that are done
    total: int

    @property
    def metrics(self) -> list[str]:
        """Names, in the order of tables."""
        return [name for name in MEANINGS if name in self.rows]

    @property
    def combinations(self) -> np.ndarray:
        """Which combination of `cross` each row belongs to."""
        return self.rows["trial"].values // self.campaign.trials

    @property
    def lasted(self) -> np.ndarray:
        """Which rows are of runs that reached their end."""
        return self.rows["status"].values == int(Status.OK)

    @property
    def flown(self) -> np.ndarray:
        """Which rows are of runs that began: their scenario could be built."""
        return self.rows["status"].values != REFUSED

    def named(self, combination: int) -> tuple[str, ...]:
        """Names of the values of `cross` in a combination."""
        return list(itertools.product(*self.campaign.cross.values()))[combination]

    def drawn(self, trial: int) -> dict[str, Any]:
        """What is drawn for a trial, by key path: numbers, or words for choices that are none."""
        row = self.rows.sel(trial=trial)
        found = {}
        for key in self.campaign.vary:
            column = row[f"vary:{key}"]
            choices = column.attrs.get("choices")
            found[key] = choices[int(column)] if choices else float(column)
        return found


def load(folder: Path) -> Results:
    """The results in the folder of a campaign.

    Raises:
        FileNotFoundError: there are none.
        OSError: they are damaged.
    """
    whole = xr.open_zarr(folder / STORE, consolidated=False, chunks=None)
    whole = whole.drop_vars([name for name in whole if str(name).startswith("series:")])
    done, chunk = whole["done"].values.astype(bool), int(whole.attrs["chunk"])
    total = whole.sizes.get("trial", 0)
    rows = whole.drop_vars("done").assign_coords(trial=np.arange(total)).isel(trial=np.repeat(done, chunk)[:total])
    try:
        rows = rows.load()
    except RuntimeError as error:  # zarr's word for a chunk that is not what was written
        raise OSError(f"{folder / STORE} is damaged ({error}); `undertow campaign --resume` flies it again") from error
    campaign, _ = read_text(whole.attrs["campaign"], Path())
    return Results(campaign, rows, total)
