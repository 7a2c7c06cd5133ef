"""The result of a comparison, and what runs one without files."""

import os
import tempfile
import warnings
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import xarray as xr

from undertow.analysis.metrics import MEANINGS
from undertow.simulation.executors import make_executor
from undertow.studies.campaign.columns import DONE
from undertow.studies.campaign.run_campaign import STORE, run_campaign
from undertow.studies.campaign.store_results import Results, load
from undertow.studies.comparison.equal_budgets import equal_budgets
from undertow.studies.comparison.findings import Findings, find
from undertow.studies.comparison.prepare import PreparedComparison, prepare_comparison

# Metrics that are compared, where they are defined: those that mean the same for every law.
_COMPARED = (
    "position_rms",
    "attitude_rms",
    "tracking_rms",
    "settling_time",
    "energy",
    "input_rms",
    "input_variation",
    "saturated_fraction",
)


class ComparisonResult(NamedTuple):
    """A finished comparison.

    Attributes:
        dataset: a column for every metric, seed, status and series, with the dimension `controller` (or `scenario`, or
            the swept key of a campaign file) and `sample`.
        findings: medians, paired differences, failures, and how the gains came about.
    """

    dataset: xr.Dataset
    findings: Findings


def read_comparison(folder: Path, results: Results, ready: PreparedComparison) -> ComparisonResult:
    """The result of a comparison whose campaign has run in a folder and was read from there."""

    with xr.open_zarr(folder / STORE, consolidated=False) as opened:
        dataset = opened.drop_vars(DONE).load()
    (axis,) = results.campaign.axes
    named = {ready.dimension: np.array(ready.names)}
    dataset = dataset.rename({axis: ready.dimension} if axis != ready.dimension else {}).assign_coords(named)
    custom_metrics = [name for name in results.metrics if name not in MEANINGS]
    metrics = [name for name in (*_COMPARED, *custom_metrics) if name in results.metrics]
    tuning = {name: note.sentence for name, note in zip(ready.names, ready.notes, strict=True)}
    findings = find(dataset, ready.dimension, metrics, tuning, ready.differing)
    return ComparisonResult(dataset, findings._replace(nominal_model=ready.prepared.trials.nominal_model()))


def run_comparison(
    scenario: str | Path | Mapping[str, Any] | Sequence[str | Path],
    controllers: Sequence[str] | Mapping[str, Any] | None = None,
    trials: int | None = None,
    *,
    tune: int | None = None,
    workers: int | None = None,
    allow_code: bool = False,
) -> ComparisonResult:
    """Run a comparison without leaving files; arguments and errors are those of `ut.compare`."""
    sources: Any = scenario
    if isinstance(scenario, str | Path):
        sources = [Path(scenario)]
    elif not isinstance(scenario, Mapping):
        sources = list(map(Path, scenario))
    with tempfile.TemporaryDirectory() as tuning_folder:
        tuner = None
        if tune is not None:
            tuner = lambda candidates, base: equal_budgets(candidates, base, tune, Path(tuning_folder))
        ready = prepare_comparison(sources, controllers, trials, allow_code, tuner)
    for sentence in ready.advice:
        warnings.warn(sentence, stacklevel=3)
    threads = workers or os.cpu_count() or 1
    with tempfile.TemporaryDirectory() as folder, make_executor(None, threads) as executor:
        run_campaign(ready.prepared, Path(folder), executor, lambda tally: None, threads)
        return read_comparison(Path(folder), load(Path(folder)), ready)
