"""The results of a campaign as they stand in its store."""

import itertools
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import xarray as xr

from undertow.analysis.meanings import MEANINGS
from undertow.core.status import Status
from undertow.studies.campaign.columns import ALWAYS
from undertow.studies.campaign.conduct import STORE
from undertow.studies.campaign.reading import read_text
from undertow.studies.campaign.schema import Campaign
from undertow.studies.campaign.store import chunk_file
from undertow.studies.campaign.task import REFUSED


class Results(NamedTuple):
    """A campaign's rows, and what they were asked for."""

    campaign: Campaign
    rows: xr.Dataset  # of the tasks that are done

    @property
    def total(self) -> int:
        """Trials that were asked for."""
        return self.campaign.number

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
    path = folder / STORE
    try:
        whole = xr.open_zarr(path, consolidated=False, chunks=None)
        if "campaign" not in whole.attrs:
            raise FileNotFoundError(path)  # of a process that was killed before anything stood there
        campaign, _ = read_text(whole.attrs["campaign"], Path())
        return Results(campaign, _done(whole, campaign, path).load())
    except FileNotFoundError:
        raise
    except Exception as error:  # zarr's and xarray's words for what is not as it was written
        raise OSError(f"{path} is damaged ({error}); `undertow campaign --resume` mends what can be mended") from error


def _done(whole: xr.Dataset, campaign: Campaign, path: Path) -> xr.Dataset:
    """Rows of the tasks that are done, without series."""
    flags = whole["done"].values.astype(bool) if "done" in whole else np.zeros(0, dtype=bool)
    own = [f"vary:{key}" for key in (*campaign.cross, *campaign.vary)] + list(ALWAYS)
    flags = [flag and all(chunk_file(path, name, task).exists() for name in own) for task, flag in enumerate(flags)]
    done = np.zeros(campaign.number, dtype=bool)
    written = np.repeat(np.array(flags, dtype=bool), whole.attrs["chunk"])[: campaign.number]
    done[: len(written)] = written
    known = whole[[name for name in own if name in whole]]
    return known.assign_coords(trial=np.arange(campaign.number)).isel(trial=done)
