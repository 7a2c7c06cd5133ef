"""Results of a campaign, read from its store."""

import itertools
import json
from collections.abc import Iterable
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import xarray as xr

from undertow.core.errors import BadInput
from undertow.core.metric import Metric
from undertow.core.status import Status
from undertow.studies.campaign.campaign_schema import Campaign, read_text
from undertow.studies.campaign.columns import DONE, FLAGS, METRICS, trial_labels
from undertow.studies.campaign.run_campaign import STORE
from undertow.studies.campaign.store import check_array, chunk_file, flags, to_be_read
from undertow.studies.campaign.store_layout import SAMPLES, StoreLayout, layout
from undertow.studies.campaign.task import INVALID


class Results(NamedTuple):
    """The rows of a campaign and its file."""

    campaign: Campaign
    rows: xr.Dataset  # of the tasks that are done
    known: dict[str, Metric]  # metrics that a trial may have, in the order of tables

    @property
    def total(self) -> int:
        """Number of trials of the campaign."""
        return self.campaign.number

    @property
    def metrics(self) -> list[str]:
        """Metrics that are defined for at least one completed trial, in the order of tables."""
        defined = lambda name: name in self.rows and not np.isnan(self.rows[name].values[self.lasted]).all()
        return [name for name in self.known if defined(name)]

    @property
    def tracking(self) -> list[str]:
        """Those of them that tell how well trials track, position first."""
        return [name for name in ("position_rms", "attitude_rms", "tracking_rms") if name in self.metrics]

    def unit(self, metric: str) -> str:
        """Unit of a metric; empty for a dimensionless number."""
        return self.rows[metric].attrs["units"].removesuffix("1") if metric in self.rows else ""

    @property
    def combinations(self) -> np.ndarray:
        """Which combination of `cross` each row belongs to."""
        return self._combination(self.rows["trial"].values)

    @property
    def lasted(self) -> np.ndarray:
        """Which rows are of completed runs."""
        return self.rows["status"].values == int(Status.OK)

    @property
    def ran(self) -> np.ndarray:
        """Which rows are of valid trials: their scenario could be built and ran."""
        return self.rows["status"].values != INVALID

    def swept(self, trial: int) -> tuple[str, ...]:
        """Names of the values of `cross` in a trial."""
        return self.named(self._combination(trial))

    def named(self, combination: int) -> tuple[str, ...]:
        """Names of the values of `cross` in a combination."""
        return list(itertools.product(*self.campaign.axes.values()))[combination]

    def _combination(self, trial: Any) -> Any:
        """Combination of one trial or several, as numbered by `Trials`."""
        return trial % (self.campaign.number // self.campaign.trials)

    def sampled(self, trial: int) -> dict[str, Any]:
        """Sampled values of a trial, by key path: numbers, or the labels of choices."""
        row = self.rows.sel(trial=trial)
        sampled = {}
        for key in self.campaign.vary:
            column = row[f"vary:{key}"]
            choices = column.attrs.get("choices")
            sampled[key] = choices[int(column)] if choices else float(column)
        return sampled


def load(folder: Path) -> Results:
    """Read the results in the folder of a campaign.

    Raises:
        FileNotFoundError: the folder has no results.
        BadInput: the metadata of the store have changed since it was written.
        OSError: the store is damaged.
    """
    path = folder / STORE
    try:
        group = to_be_read(path)
        if "campaign" not in group.attrs:
            raise FileNotFoundError(path)  # from a process killed before its first write
        campaign, _ = read_text(str(group.attrs["campaign"]), Path())
        stored = layout(campaign)._replace(chunk=tuple(group.attrs["chunk"]))
        metrics = {name: Metric(*fields) for name, fields in json.loads(str(group.attrs.get(METRICS, "{}"))).items()}
        labels = trial_labels(campaign, metrics)
        for name, label in {**labels, DONE: FLAGS}.items():
            if name in group:
                check_array(group[name], label, (1,) if name == DONE else stored.chunk, path)
        rows = _rows(group, campaign, stored, labels)
        done = _done(group, campaign, stored, path, labels)
        return Results(campaign, rows if done.all() else rows.isel(trial=done), metrics)
    except (FileNotFoundError, BadInput):
        raise
    except Exception as error:  # zarr raises many kinds of errors for damaged files
        raise OSError(f"{path} is damaged ({error}); `undertow campaign --resume` repairs it where possible") from error


def _rows(group: Any, campaign: Campaign, stored: StoreLayout, names: Iterable[str]) -> xr.Dataset:
    """All rows of the store by trial, without series.

    Arrays may be longer while a process makes room for more samples.
    """
    axes = (*campaign.axes, SAMPLES)
    region = tuple(slice(0, size) for size in stored.shape)
    arrays = {name: group[name] for name in names if name in group and name != "trial"}
    rows = xr.Dataset({name: (axes, array[region], dict(array.attrs)) for name, array in arrays.items()})
    if arrays:
        rows = rows.stack({"trial": (SAMPLES, *campaign.axes)}, create_index=False)  # as they are numbered
    return rows.assign_coords(trial=np.arange(campaign.number)).assign_attrs(group.attrs)


def _done(group: Any, campaign: Campaign, stored: StoreLayout, path: Path, names: Iterable[str]) -> np.ndarray:
    """Which trials belong to finished tasks."""
    done = np.zeros(campaign.number, dtype=bool)
    for task in np.flatnonzero(flags(group[DONE], stored.tasks)).tolist() if DONE in group else ():
        block = stored.block(task)
        if all(chunk_file(path, name, block, len(block)).exists() for name in names):
            done[stored.trials(task)] = True
    return done
