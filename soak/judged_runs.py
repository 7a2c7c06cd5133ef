"""Runs of many scenarios, those of one program together, each judged for never-events."""

import hashlib
import math
from collections.abc import Callable, Mapping, Sequence
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

from soak.counters import Counts, Watch
from undertow.control.supervision.conditions import state_of
from undertow.control.supervision.supervised_controller import state_in
from undertow.control.supervision.transition_log import SupervisorTransition, transitions
from undertow.core.arrays import as_array
from undertow.core.authority import limits_of
from undertow.core.status import Status
from undertow.scenario.build import Built, build, in_its_precision
from undertow.scenario.part_cache import PartCache
from undertow.scenario.prepare import prepare
from undertow.simulation.loop.outcome import Outcome
from undertow.simulation.prepared_run import PreparedRun
from undertow.simulation.run_many import run_many

_BEGINNING = 2  # transitions to READY and to ACTIVE
_AT_ONCE = 512  # runs of one call: the memory of their results


class Judged(NamedTuple):
    """One run with what was counted.

    Attributes:
        status: how it ended.
        state: of the supervisor at the end; "" without one.
        transitions: of the supervisor, the last ones.
        alarms: transitions after those with which control begins.
        ended: s; when it failed, else the duration.
        counts: of `watching.Counts`, of this run.
        finite: whether all states are finite at the end.
        steps: that it should have.
        digest: of the bytes of its final state, status and counts.
        backend: simd, or xla where the batch compiler lacks an operation.
    """

    status: Status
    state: str
    transitions: tuple[SupervisorTransition, ...]
    alarms: int
    ended: float
    counts: Counts
    finite: bool
    steps: int
    digest: str
    backend: str

    def events(self) -> list[tuple[str, str]]:
        """Never-events of the run, and what happened in each."""
        counts = self.counts
        events = []
        if counts.undefined_inputs > 0:
            events.append(("N1", f"an input that is not finite at {int(counts.undefined_inputs)} steps"))
        if counts.exceeded_limits > 0:
            events.append(("N1", f"an input beyond its limits at {int(counts.exceeded_limits)} steps"))
        if self.status is Status.OK and not (self.finite and counts.undefined_outputs == 0):
            events.append(("N4", "a run that is completed has states that are not finite"))
        if int(counts.steps) != self.steps:
            events.append(("N4", f"{int(counts.steps)} of {self.steps} steps were counted"))
        return events

    def rms(self) -> np.ndarray:
        """Tracking error of each window and axis, rms; NaN for a window without samples. Shape (windows, n)."""
        samples = self.counts.samples[:, None]
        return np.sqrt(np.where(samples > 0, self.counts.squares, np.nan) / np.maximum(samples, 1))


def judged_runs(
    scenarios: Sequence[Mapping[str, Any]],
    windows: int = 1,
    watch: Callable[[int], None] = lambda done: None,
    workers: int = 2,
) -> list[Judged]:
    """Run scenarios and judge each of them; their order is kept.

    Args:
        scenarios: sampled ones, as mappings.
        windows: number of equal windows of time for the tracking error.
        watch: called with the number of runs that have ended.
        workers: threads.

    Raises:
        BadInput: a scenario is invalid.
    """
    cache = PartCache()
    return judge([watched(build(scenario, cache), windows) for scenario in scenarios], watch, workers)


def judge(
    runs: Sequence[PreparedRun], watch: Callable[[int], None] = lambda done: None, workers: int = 2
) -> list[Judged]:
    """The same for runs of `watched`."""
    judged: dict[int, Judged] = {}
    at_once = min(_AT_ONCE, math.ceil(len(runs) / workers)) if runs else 1
    for batch in run_many(runs, workers=workers, at_once=at_once, watch=watch):
        for index, outcome in batch.each():
            judged[index] = _judged(outcome, runs[index].plan.steps, batch.backend)
    return [judged[index] for index in range(len(runs))]


@in_its_precision
def watched(built: Built, windows: int) -> PreparedRun:
    """A run of a scenario in which never-events are counted."""
    loop, plant = built.scenario.loop, built.closed_loop.plant
    start = built.closed_loop.outputs_at_start(built.scenario.initial.position, built.scenario.initial.velocity)
    x = plant.initial_state(*map(jnp.asarray, start))
    least, largest, length = map(as_array, (*map(np.asarray, limits_of(plant, x)), loop.duration / windows))
    return prepare(built, accumulators=(Watch(least, largest, length, windows),))


def _judged(outcome: Outcome, steps: int, backend: str) -> Judged:
    result: Any = outcome._replace(time=(), signals=())
    leaves = [np.asarray(leaf) for leaf in jax.tree.leaves(result)]
    digest = hashlib.sha256(b"".join(leaf.tobytes() for leaf in leaves)).hexdigest()[:16]
    final = [np.asarray(leaf) for leaf in jax.tree.leaves(result.final)]
    finite = all(bool(np.isfinite(leaf).all()) for leaf in final if np.issubdtype(leaf.dtype, np.inexact))
    status = Status(int(result.status))
    supervised = state_in(result.final[1])
    state = "" if supervised is None else state_of(int(supervised.state)).name
    changes = () if supervised is None else tuple(transitions(supervised.log))
    alarms = 0 if supervised is None else max(0, int(supervised.log.number) - _BEGINNING)
    return Judged(
        status, state, changes, alarms, float(result.ended), result.accumulated[0], finite, steps, digest, backend
    )
