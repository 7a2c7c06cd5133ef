"""A task of a campaign: build and run some trials. It is given as text and numbers, so that any process can run it."""

import contextlib
import functools
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import jax
import numpy as np

from undertow.analysis.metrics import gathered_meanings
from undertow.core import runtime
from undertow.core.errors import BadInput
from undertow.core.metric import Metric
from undertow.scenario.build import Built
from undertow.scenario.part_cache import PartCache
from undertow.simulation.prepared_run import RunBatch
from undertow.simulation.programs import ProgramCache
from undertow.studies.campaign.build_trials import TraceableKinds, build_data, build_trial, build_trials, valid_trials
from undertow.studies.campaign.campaign_schema import read_text
from undertow.studies.campaign.requirements import formula_metrics, recorded, robustness
from undertow.studies.campaign.store_layout import StoreLayout
from undertow.studies.campaign.trial_results import prepare_trial, run_prepared
from undertow.studies.campaign.trials import Trials, trials, varied_keys

# Status of a trial whose scenario cannot be built, in addition to those of `undertow.core.status`.
INVALID = -1

# Success of a trial that was invalid, or has no criterion.
NOT_JUDGED = -1


class TaskContext(NamedTuple):
    """Objects that a process keeps between the tasks of one campaign."""

    trials: Trials
    part_cache: PartCache
    programs: ProgramCache
    traceable: TraceableKinds  # see `build_trials`
    representative_trials: Callable[[], dict[int, Built]]  # the valid ones among the first trials of every combination
    alternatives: Callable[[], list[Built]]  # the first trial with each entry of every choice, where valid

    def metrics(self) -> dict[str, Metric]:
        """Metrics that any of the trials may have. Each has a column, which is NaN where a trial has no such metric."""
        metrics: dict[str, Metric] = {}
        for built in (*self.representative_trials().values(), *self.alternatives()):
            metrics = gathered_meanings(built.closed_loop, built.metrics) | metrics
        return metrics | formula_metrics(self.trials.campaign)


@functools.lru_cache(maxsize=2)
def task_context(text: str, folder: str) -> TaskContext:
    """The campaign of this text in this process; relative paths in it start at the folder."""
    campaign_trials = trials(*read_text(text, Path(folder)))
    part_cache = PartCache()
    rows = campaign_trials.representative_trials()
    probes = functools.cache(
        lambda: {rows[index]: built for index, built in valid_trials(campaign_trials, part_cache, rows)}
    )
    alternatives = functools.cache(lambda: list(_alternatives(campaign_trials, part_cache)))
    programs = ProgramCache(lambda: [prepare_trial(built, None) for built in probes().values()], gpu=True)
    return TaskContext(campaign_trials, part_cache, programs, TraceableKinds(), probes, alternatives)


def run_block(text: str, folder: str, layout: StoreLayout, task: int) -> dict[str, np.ndarray]:
    """Columns of the trials of a task."""
    return run_trials(text, folder, layout.trials(task).tolist())


def run_trials(text: str, folder: str, rows: Sequence[int]) -> dict[str, np.ndarray]:
    """Run the trials of these numbers and return their columns: sampled values, status and metrics."""
    with runtime.on_processor():
        return _ran(task_context(text, folder), rows)


def _ran(context: TaskContext, rows: Sequence[int]) -> dict[str, np.ndarray]:
    trials = np.array(rows, dtype=np.int64)
    sampled = context.trials.sampled(trials)
    columns = {f"vary:{key}": column for key, column in _columns(context.trials, sampled)}
    columns["trial"] = trials.astype(np.uint32)
    columns["seed"] = context.trials.seeds(trials)
    result_rows: list[int] = []
    criteria: list[Mapping[str, float]] = []
    firsts: list[Built] = []

    def batches() -> Iterator[RunBatch]:
        for trial_batch in build_trials(context.trials, context.part_cache, trials, sampled, context.traceable):
            result_rows.extend(trial_batch.places.tolist())
            firsts.extend([trial_batch.first] * len(trial_batch.places))
            is_judged = trial_batch.first.window()[0] < trial_batch.first.scenario.loop.duration
            criteria.extend([trial_batch.first.resolved["success"] if is_judged else {}] * len(trial_batch.places))
            yield trial_batch.batch

    campaign = context.trials.campaign
    series = (
        recorded(campaign, next(iter(context.representative_trials().values())))
        if campaign.formulas
        else campaign.series
    )
    result = run_prepared(batches(), context.programs)
    if result is None:  # no trials: the arrays of one trial, cut to length zero
        one_trial = run_prepared(
            [prepare_trial(next(iter(context.representative_trials().values())), series)], context.programs
        )
        result = jax.tree.map(lambda values: values[:0], one_trial)
    robust = robustness(campaign, firsts, result.series, result.status, result.ended)
    scatter = functools.partial(_scatter, len(rows), result_rows)
    columns["status"] = scatter(result.status, INVALID)
    columns["ended"] = scatter(result.ended, np.nan)
    columns["backend"] = scatter(result.backend, INVALID)
    columns["success"] = scatter(_success(criteria, result.metrics), NOT_JUDGED)
    undefined = np.full(len(result_rows), np.nan)
    result_columns = {name: result.metrics.get(name, undefined) for name in context.metrics()}
    result_columns |= robust
    series_names = campaign.series.signals if campaign.series is not None else ()
    result_columns |= {f"series:{name}": result.series[name] for name in series_names}
    if "precision" in campaign.keys:  # one array holds both
        result_columns = {name: values.astype(np.float64) for name, values in result_columns.items()}
    return columns | {name: scatter(values, np.nan) for name, values in result_columns.items()}


def _alternatives(campaign_trials: Trials, part_cache: PartCache) -> Iterator[Built]:
    """They may name other files, and have metrics of their own."""
    for data in campaign_trials.alternatives():
        with contextlib.suppress(BadInput):
            yield build_data(campaign_trials, part_cache, data)


def _success(criteria: Sequence[Mapping[str, float]], metrics: Mapping[str, np.ndarray]) -> np.ndarray:
    """1 where all that a trial is judged by stays below its limit, 0 where not, `NOT_JUDGED` without a criterion."""
    success = np.full(len(criteria), NOT_JUDGED, dtype=np.int8)
    for i, criterion in enumerate(criteria):
        if criterion:  # what is not defined, as in a run that failed, is NaN and below nothing
            success[i] = all(name in metrics and metrics[name][i] < most for name, most in criterion.items())
    return success


def _columns(campaign_trials: Trials, sampled: Mapping[str, list[Any]]) -> Iterable[tuple[str, np.ndarray]]:
    """Sampled values; the index of the choice where they are not numbers."""
    for key, entries in varied_keys(campaign_trials.campaign):
        pick: Any = float if entries is None else list(entries.values()).index
        yield key, np.array([pick(value) for value in sampled[key]], dtype=float)


def _scatter(count: int, rows: list[int], values: np.ndarray, empty: Any) -> np.ndarray:
    """An array with values at their rows and `empty` elsewhere."""
    column = np.full((count, *values.shape[1:]), empty, dtype=values.dtype)
    column[rows] = values
    return column


# Trials that are built again: each takes milliseconds.
_MOST = 200


class InvalidTrials(NamedTuple):
    """Trials that are invalid for the same reason."""

    why: str  # the error of the first of them
    trials: int


def reasons(campaign_trials: Trials, rows: Sequence[int]) -> tuple[InvalidTrials, ...]:
    """The reasons why trials are invalid, the most frequent first.

    Args:
        campaign_trials: the trials.
        rows: numbers of the invalid trials; only the first 200 are built again.
    """
    part_cache = PartCache()
    messages_by_cause = dict[tuple[str, str], list[str]]()
    for row in rows[:_MOST]:
        try:
            build_trial(campaign_trials, part_cache, int(row))
        except BadInput as error:
            messages_by_cause.setdefault((error.name, error.must), []).append(str(error))
    most_frequent_first = sorted(messages_by_cause.values(), key=len, reverse=True)
    return tuple(InvalidTrials(messages[0], len(messages)) for messages in most_frequent_first)
