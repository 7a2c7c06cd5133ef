"""Columns of a results store: dimensions, meanings, units and codes."""

from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np
import xarray as xr

from undertow.core.metric import Metric
from undertow.core.status import Status
from undertow.scenario.build import Built
from undertow.simulation.loop import dataset
from undertow.studies.campaign.campaign_schema import Campaign
from undertow.studies.campaign.labels import is_number, words
from undertow.studies.campaign.store_layout import SAMPLES
from undertow.studies.campaign.task import INVALID, NOT_JUDGED
from undertow.studies.campaign.trial_results import SIMD, XLA, prepare_trial
from undertow.studies.campaign.trials import Trials, varied_keys

# Codes of the columns `status` and `backend`, and their words.
ENDINGS = {int(status): status.word for status in Status} | {INVALID: "invalid"}
BACKENDS = {SIMD: "simd", XLA: "xla", INVALID: "none"}
JUDGEMENTS = {1: "within", 0: "not_within", NOT_JUDGED: "not_judged"}

_AFTER = "a failed run keeps its last value: see `ended`"


def _said(meaning: str, unit: str) -> dict[str, Any]:
    return {"long_name": meaning, "units": unit or "1"}


def _codes(name: str, words: dict[int, str]) -> dict[str, Any]:
    """Codes and their words, as in the CF conventions."""
    return {"long_name": name, "flag_values": list(words), "flag_meanings": " ".join(words.values())}


# Columns of every campaign, with their attributes; its metrics come beside them.
ALWAYS: dict[str, dict[str, Any]] = {
    "trial": {"long_name": "trial number, as in the file names of the worst trials"},
    "seed": {"long_name": "seed of all random numbers of the trial"},
    "status": _codes("how the run ended", ENDINGS),
    "backend": _codes("backend that ran the trial", BACKENDS),
    "ended": {"long_name": "time at which the run ended", "units": "s"},
    "success": _codes("whether the run kept to the scenario's criterion of success", JUDGEMENTS),
}


# Flag of a task that is done, and its attributes.
DONE = "done"

METRICS = "metrics"  # attribute of the store: unit and meaning of each, by name, as JSON


class Label(NamedTuple):
    """Description of one array of the store."""

    dimensions: tuple[str, ...]
    attributes: dict[str, Any]
    dtype: str = "float64"  # independent of the precision of the runs, which a campaign may sweep


FLAGS = Label(("task",), {"long_name": "1 for tasks that are written"}, "uint8")
_DTYPES = {"trial": "uint32", "seed": "uint32", "status": "int8", "backend": "int8", "success": "int8"}


def labels(campaign_trials: Trials, built: Built, metrics: Mapping[str, Metric]) -> dict[str, Label]:
    """Labels of all columns, by name; `built` is one of the trials, `metrics` are those that any of them may have."""
    columns = trial_labels(campaign_trials.campaign, metrics)
    dimensions = (*campaign_trials.campaign.axes, SAMPLES)
    loop = built.closed_loop
    for name in campaign_trials.campaign.series.signals if campaign_trials.campaign.series else ():
        signal = loop.signals()[name]
        attributes = _said(*dataset.meaning(signal, loop.plant)) | {"comment": _AFTER}
        columns[f"series:{name}"] = Label((*dimensions, *dataset.dimensions(signal)), attributes)
    return columns


def trial_labels(campaign: Campaign, metrics: Mapping[str, Metric]) -> dict[str, Label]:
    """Labels of the columns that hold a number for each trial, by name."""
    of_metrics = {name: _said(metric.meaning, metric.unit) for name, metric in metrics.items()}
    sampled: dict[str, dict[str, Any]] = {
        f"vary:{key}": {"long_name": key} if entries is None else {"long_name": key, "choices": list(entries)}
        for key, entries in varied_keys(campaign)
    }
    dimensions = (*campaign.axes, SAMPLES)
    of_trials = sampled | ALWAYS | of_metrics
    return {name: Label(dimensions, attributes, _DTYPES.get(name, "float64")) for name, attributes in of_trials.items()}


def coordinates(campaign_trials: Trials, built: Built) -> dict[str, xr.Variable]:
    """Coordinates of the dimensions: values of `cross`, or their names; and those of recorded series."""
    axes = campaign_trials.campaign.axes
    variables = {key: xr.Variable((key,), _swept(entries), {"long_name": key}) for key, entries in axes.items()}
    if campaign_trials.campaign.series is None:
        return variables
    times = prepare_trial(built, campaign_trials.campaign.series).plan.times()
    return variables | dataset.coordinates(times, built.closed_loop.plant)


def _swept(entries: dict[str, Any]) -> np.ndarray:
    """The values where they are unnamed numbers or booleans; otherwise their names."""
    values = list(entries.values())
    named = any(name != words(value) for name, value in entries.items())
    if not named and all(isinstance(value, bool) for value in values):
        return np.array(values)
    return np.array(values, dtype=float) if not named and all(map(is_number, values)) else np.array(list(entries))
