"""Trials as runs of many, and their metrics, statuses and series in the order of the trials."""

from collections.abc import Iterable, Mapping
from typing import NamedTuple

import numpy as np

from undertow.analysis.metrics import results_of_batch
from undertow.core import runtime
from undertow.core.status import Status
from undertow.scenario.build import Built
from undertow.scenario.prepare import prepare
from undertow.simulation.prepared_run import PreparedRun, RunBatch
from undertow.simulation.programs import ProgramCache
from undertow.simulation.run_many import BatchResult, in_order, run_many
from undertow.studies.campaign.campaign_schema import RecordedSignals

# Codes of the backends. XLA is slower, and a single run repeats such a trial only up to rounding.
SIMD, XLA = 0, 1
_CODES = {"simd": SIMD, "xla": XLA}


class TrialResults(NamedTuple):
    """Results of trials, one entry per trial."""

    metrics: dict[str, np.ndarray]  # over the steady window; NaN for failed runs and undefined metrics
    status: np.ndarray
    ended: np.ndarray  # s
    backend: np.ndarray  # SIMD or XLA
    series: dict[str, np.ndarray]  # (trials, records, ...)


def prepare_trial(built: Built, series: RecordedSignals | None) -> PreparedRun:
    """A trial, ready to run, with the series that are recorded of it."""
    return prepare(built) if series is None else prepare(built, series.signals, series.every)


def run_prepared(trials: Iterable[PreparedRun | RunBatch], programs: ProgramCache) -> TrialResults | None:
    """Results of trials that record the same series; None without trials."""
    batches = list(run_many(trials, programs=programs))
    if not batches:
        return None
    metrics = [_metrics(batch) for batch in batches]
    names = dict.fromkeys(name for columns in metrics for name in columns)
    return in_order(batches, [_results(*pair, names) for pair in zip(batches, metrics, strict=True)])


def _metrics(batch: BatchResult) -> dict[str, np.ndarray]:
    with runtime.in_precision(batch.first.precision):
        metrics = results_of_batch(batch.first.run.accumulators, batch.outcome.accumulated)
    lasted = batch.outcome.status == int(Status.OK)
    return {name: np.where(lasted, values, np.nan) for name, values in metrics.items()}


def _results(batch: BatchResult, metrics: Mapping[str, np.ndarray], names: Iterable[str]) -> TrialResults:
    count = len(batch.places)
    undefined = np.full(count, np.nan)  # a law or a plant may have no metric of a name
    return TrialResults(
        {name: metrics.get(name, undefined) for name in names},
        np.asarray(batch.outcome.status).astype(np.int8),
        np.asarray(batch.outcome.ended),
        np.full(count, _CODES[batch.backend], dtype=np.int8),
        {name: np.asarray(values) for name, values in batch.outcome.signals.items()},
    )
