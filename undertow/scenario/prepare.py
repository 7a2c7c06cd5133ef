"""A built scenario as a run that `run_many` takes."""

from collections.abc import Sequence
from typing import Any

from undertow.analysis.metrics import accumulators as metric_accumulators
from undertow.core.numerics.random_keys import key_of_seed
from undertow.scenario.build import Built, in_its_precision
from undertow.simulation.loop import continuous
from undertow.simulation.loop.loop_runs import LoopRun, RunPlan
from undertow.simulation.loop.sampled import AbstractAccumulator
from undertow.simulation.prepared_run import PreparedRun

_STARTS = ("position", "velocity")


def steady_accumulators(built: Built) -> tuple[AbstractAccumulator, ...]:
    """What gathers the steady metrics of a scenario along a run."""
    return metric_accumulators(built.closed_loop.plant, built.metrics, *built.window())


@in_its_precision
def loop_run(built: Built, accumulators: tuple[AbstractAccumulator, ...] | None = None) -> LoopRun:
    """Loop, accumulators, start and key of a scenario; its metrics are accumulated unless others are given."""
    scenario, loop = built.scenario, built.closed_loop
    start = loop.outputs_at_start(*(getattr(scenario.initial, name) for name in _STARTS))
    if accumulators is None:
        accumulators = steady_accumulators(built)
    return LoopRun(loop, accumulators, start, key_of_seed(scenario.seed))


def run_plan(built: Built, signals: Sequence[str] = (), every: float = 0.0) -> RunPlan:
    """Steps, recorded signals and time between their records (s; 0 for none) of a scenario with fixed steps."""
    settings = built.scenario.loop
    if settings.kind == "continuous":
        steps, every_steps, dt = continuous.grid_of(settings.duration, every or settings.duration, settings.dt)
        return RunPlan(steps, dt, every_steps, tuple(signals), continuous=True)
    steps = round(settings.duration / settings.dt)
    return RunPlan(steps, settings.dt, round(every / settings.dt), tuple(signals), settings.method, settings.substeps)


def prepare(
    built: Built,
    signals: Sequence[str] = (),
    every: float = 0.0,
    accumulators: tuple[AbstractAccumulator, ...] | None = None,
) -> PreparedRun:
    """A scenario, ready for `run_many`.

    Args:
        built: the scenario; its integration has fixed steps.
        signals: names of the signals that are recorded.
        every: time between records, s; 0 for none.
        accumulators: what is accumulated at every step; the metrics of the scenario unless given.
    """
    scenario: Any = built.scenario
    return PreparedRun(
        loop_run(built, accumulators), run_plan(built, signals, every), scenario.loop.backend, scenario.precision
    )
