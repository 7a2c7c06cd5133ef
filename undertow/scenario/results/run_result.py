"""Result of a finished run: status, metrics and verdicts, and a self-describing dataset."""

import dataclasses
import functools
import math
from collections.abc import Mapping
from types import MappingProxyType
from typing import Any, NamedTuple

import numpy as np
import xarray as xr

from undertow.analysis.certify import certify
from undertow.analysis.metrics import Gathered, meanings, measure, results
from undertow.analysis.navigation_consistency import navigation_consistency
from undertow.analysis.success import Success, evaluate_success
from undertow.analysis.temporal.requirements import (
    Requirement,
    Verdict,
    contiguous,
    evaluate_requirements,
    needed_signals,
)
from undertow.control.supervision.supervised_controller import state_in, unsupervised
from undertow.control.supervision.transition_log import transitions
from undertow.core.contracts import AbstractController
from undertow.core.json_text import finite_numbers
from undertow.core.metric import AbstractMetric, Metric
from undertow.core.status import Status
from undertow.physics.faults.of_computation import law_of_computed
from undertow.physics.plants.hybrid_vehicle import HybridVehicle
from undertow.physics.power.ledger import closure
from undertow.scenario.build import Built
from undertow.scenario.provenance import checksum, content_hash, versions
from undertow.scenario.results.run_facts import RunFacts
from undertow.scenario.unactuated_attitude import unactuated_axes
from undertow.simulation.loop.closed_loop import ClosedLoop
from undertow.simulation.loop.dataset import to_dataset
from undertow.simulation.loop.outcome import Outcome


@dataclasses.dataclass(frozen=True, repr=False)
class RunRecord:
    """What is known of a finished run, in memory or from its result file.

    Attributes:
        series: recorded signals with names and units, and those of the certificate.
        facts: everything else.
    """

    series: xr.Dataset
    facts: RunFacts


@dataclasses.dataclass(frozen=True, repr=False)
class RunResult(RunRecord):
    """One finished run.

    Attributes:
        loop: the closed loop that was run.
        outcome: its signals as arrays, and its final states.
    """

    loop: ClosedLoop
    outcome: Outcome

    @property
    def status(self) -> Status:
        """How it ended."""
        return self.facts.status

    @property
    def steady(self) -> Mapping[str, Any] | None:
        """Metrics over the steady window; None when the run ended early."""
        return self.facts.steady

    @property
    def whole(self) -> Mapping[str, Any]:
        """Metrics of the whole run."""
        return self.facts.whole

    @property
    def success(self) -> Success | None:
        """Whether control succeeded; None without a criterion."""
        return self.facts.success

    @functools.cached_property
    def dataset(self) -> xr.Dataset:
        """Series and facts as one dataset, with hashes that reveal changes: what a result file holds."""
        dataset = self.series.copy()
        dataset.attrs = self.facts.attributes()
        dataset.attrs["content_hash"] = content_hash(dataset)
        dataset.attrs["checksum"] = checksum(dataset)
        return dataset


@dataclasses.dataclass(frozen=True, repr=False)
class ScenarioResult(RunResult):
    """One finished run of a scenario.

    Attributes:
        built: the scenario.
    """

    built: Built


class MetricsSettings(NamedTuple):
    """How a run is measured.

    Attributes:
        window: start and stop of the steady metrics, s.
        dt: sampling time, s.
        own: metrics of the scenario's own.
        criterion: of success.
        gathered: what has gathered the steady metrics along the run; () where the record is what counts.
        requirements: on the run.
        record: time between records, s.
        duration: asked for, s.
    """

    window: tuple[float, float]
    dt: float
    own: tuple[AbstractMetric, ...] = ()
    criterion: Mapping[str, float] = MappingProxyType({})
    gathered: Gathered = ()
    requirements: tuple[Requirement, ...] = ()
    record: float = math.nan
    duration: float = math.nan


class Origin(NamedTuple):
    """Where a run comes from.

    Attributes:
        title: of the run.
        seed: of everything random.
        scenario: with every default filled in; empty for a closed loop made of objects.
        code: hashes of the user's code files.
        left_to_xla: why the SIMD backend could not be used; "" otherwise.
        why: a sentence on why it failed; "" for that of its status.
    """

    title: str
    seed: int
    scenario: Mapping[str, Any] = MappingProxyType({})
    code: str = ""
    left_to_xla: str = ""
    why: str = ""


def make_result(loop: ClosedLoop, outcome: Outcome, settings: MetricsSettings, origin: Origin) -> RunResult:
    """Compute the metrics of a run, and judge it.

    Args:
        loop: the closed loop.
        outcome: its outcome.
        settings: of the measurement.
        origin: of the run.
    """
    status, ended = Status(int(outcome.status)), float(outcome.ended)
    series, law = to_dataset(outcome, loop), law_of(loop)
    steady, whole = _metrics(loop, outcome, series, settings)
    certified = certify(series, law, settings.window, settings.dt)
    if certified is not None:
        series = series.assign(certified.signals)
    lasted_but_unseen = status is Status.OK and steady is None
    supervised = state_in(outcome.final[1])
    unactuated, lost_axes = _uncontrolled(loop, series)
    metric_names = {*whole, *settings.criterion}  # a run that failed at once lacks metrics that its criterion names
    facts = RunFacts(
        status=status,
        ended=ended,
        sentence=origin.why or outcome.sentence(),
        title=origin.title,
        seed=origin.seed,
        steady=steady,
        whole=whole,
        meanings={
            name: _between_records(name, metric, settings)
            for name, metric in meanings(loop, settings.own).items()
            if name in metric_names
        },
        scenario=origin.scenario,
        success=None if lasted_but_unseen else evaluate_success(settings.criterion, steady),
        requirements=_verdicts(outcome, settings, steady or {}),
        certificate=None if certified is None else finite_numbers(certified.summary),
        navigation=finite_numbers(navigation_consistency(loop, series, steady)),
        transitions=None if supervised is None else transitions(supervised.log),
        unactuated=unactuated,
        lost_axes=lost_axes,
        code=origin.code,
        left_to_xla=origin.left_to_xla,
        versions=versions(),
    )
    return RunResult(series, facts, loop, outcome)


def _uncontrolled(loop: ClosedLoop, series: xr.Dataset) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """Axes that no thruster controls, and further ones since thrusters were taken out of use."""
    if not isinstance(loop.plant, HybridVehicle):
        return (), ()
    matrix = np.asarray(loop.plant.thruster_matrix, dtype=float)
    unactuated = unactuated_axes(matrix)
    if "lost_thrusters" not in series:
        return unactuated, ()
    in_use = ~np.asarray(series["lost_thrusters"].values, dtype=bool).any(axis=0)
    return unactuated, tuple(axis for axis in unactuated_axes(matrix[:, in_use]) if axis not in unactuated)


def _between_records(name: str, metric: Metric, settings: MetricsSettings) -> Metric:
    """A metric, and the variation of the input as what it is where records are further apart than control steps."""
    if name != "input_variation" or settings.gathered or not settings.record > 1.5 * settings.dt:
        return metric
    unseen = "; what changes between records is not in it: `steady: {every_step: true}` counts every control step"
    return metric._replace(name=f"{metric.name} between records", meaning=metric.meaning + unseen)


def _metrics(
    loop: ClosedLoop, outcome: Outcome, series: xr.Dataset, settings: MetricsSettings
) -> tuple[dict[str, Any] | None, dict[str, Any]]:
    """Metrics over the steady window, None where the run did not reach it, and of the whole run."""
    status, ended, number = Status(int(outcome.status)), float(outcome.ended), rules(law_of(loop))
    counted = {} if number is None else {"rules": number}

    def over(start: float, stop: float) -> dict[str, Any]:
        measured = measure(outcome, loop.plant, start, stop, settings.own)
        return measured | closure(series, start, stop) | counted

    covered = status is Status.OK and settings.window[0] < ended
    steady = over(*settings.window) if covered else None
    if steady is not None and settings.gathered:
        steady |= results(settings.gathered, outcome.accumulated)
    # A run ended by an invalid command has no input at that instant.
    return steady, over(0.0, ended - settings.dt / 2 if status is Status.COMMAND_NOT_FINITE else ended)


def _verdicts(outcome: Outcome, settings: MetricsSettings, steady: Mapping[str, Any]) -> dict[str, Verdict]:
    """Verdict by each requirement."""
    if not settings.requirements:
        return {}
    signals = contiguous(outcome.signals, needed_signals(settings.requirements))
    ending = int(outcome.status), float(outcome.ended), settings.duration
    return evaluate_requirements(settings.requirements, signals, settings.record, steady, *ending)


def law_of(loop: ClosedLoop) -> AbstractController:
    """The control law of a loop, without supervision and faults of its computer."""
    return unsupervised(law_of_computed(loop.controller))


def rules(law: AbstractController) -> int | None:
    """Number of fuzzy rules per axis; None for a controller without a fuzzy system."""
    fuzzy = getattr(law, "fuzzy", None)
    return None if fuzzy is None else fuzzy.rules
