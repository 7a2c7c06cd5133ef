"""Runs of many scenarios, those of one program together, each judged for never-events."""

import hashlib
import math
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from functools import partial
from typing import Any, NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np

from undertow.core import runtime
from undertow.core.arrays import as_array
from undertow.core.authority import limits_of
from undertow.core.status import Status
from undertow.loop import simd_batch, vmap_batch
from undertow.loop.outcome import Outcome
from undertow.loop.simd_batch import Plan, Run
from undertow.numerics.random_keys import key_of_seed
from undertow.scenario.build import Built, build, in_its_precision
from undertow.scenario.part_cache import PartCache, structure
from undertow.soak.watching import Counts, Watch
from undertow.supervision.conditions import state_of
from undertow.supervision.supervised_controller import state_in
from undertow.supervision.transition_log import Transition, transitions

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
    transitions: tuple[Transition, ...]
    alarms: int
    ended: float
    counts: Counts
    finite: bool
    steps: int
    digest: str
    backend: str

    def events(self) -> list[tuple[str, str]]:
        """Never-events of the run, and what happened in each."""
        counts, found = self.counts, []
        if counts.undefined_inputs > 0:
            found.append(("N1", f"an input that is not finite at {int(counts.undefined_inputs)} steps"))
        if counts.exceeded_limits > 0:
            found.append(("N1", f"an input beyond its limits at {int(counts.exceeded_limits)} steps"))
        if self.status is Status.OK and not (self.finite and counts.undefined_outputs == 0):
            found.append(("N4", "a run that is completed has states that are not finite"))
        if int(counts.steps) != self.steps:
            found.append(("N4", f"{int(counts.steps)} of {self.steps} steps were counted"))
        return found

    def rms(self) -> np.ndarray:
        """Tracking error of each window and axis, rms; NaN for a window without samples. Shape (windows, n)."""
        samples = self.counts.samples[:, None]
        return np.sqrt(np.where(samples > 0, self.counts.squares, np.nan) / np.maximum(samples, 1))


class Group(NamedTuple):
    """Runs of one program: the first of them, their plan, precision, places among all, and the arrays of each."""

    first: Run
    plan: Plan
    precision: str
    members: list[int]
    numbers: list[list[np.ndarray]]


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
    return judged_groups(_grouped([prepared(build(one, cache), windows) for one in scenarios]), watch, workers)


def judged_groups(
    groups: Sequence[Group], watch: Callable[[int], None] = lambda done: None, workers: int = 2
) -> list[Judged]:
    """The same for runs that are built already, in groups of one program each."""
    found: list[Judged | None] = [None] * sum(len(group.members) for group in groups)
    outer = max(1, min(workers, len(groups)))
    done = 0
    with ThreadPoolExecutor(outer) as threads:
        for group, several in threads.map(partial(_all_of, workers=workers // outer), groups):
            for place, one in zip(group.members, several, strict=True):
                found[place] = one
            done += len(several)
            watch(done)
    return [one for one in found if one is not None]


def _all_of(group: "Group", workers: int) -> tuple["Group", list[Judged]]:
    """All runs of a group, by so many threads."""
    count = len(group.members)
    with runtime.in_precision(group.precision), runtime.on_processor():
        program, shared = _program(group)
        cuts = np.array_split(np.arange(count), min(count, max(workers, math.ceil(count / _AT_ONCE))))
        with runtime.workers(workers) as threads:
            parts = threads.map(partial(_run, group, program, shared), cuts)
            return group, [one for several in parts for one in several]


@in_its_precision
def prepared(built: Built, windows: int) -> tuple[Run, Plan, str]:
    """A run of a scenario that is watched, its plan and its precision."""
    loop, plant = built.scenario.loop, built.closed_loop.plant
    start = built.closed_loop.outputs_at_start(built.scenario.initial.position, built.scenario.initial.velocity)
    x = plant.initial_state(*map(jnp.asarray, start))
    least, largest, length = map(as_array, (*map(np.asarray, limits_of(plant, x)), loop.duration / windows))
    watching = (Watch(least, largest, length, windows),)
    run = Run(built.closed_loop, watching, start, key_of_seed(built.scenario.seed))
    plan = Plan(round(loop.duration / loop.dt), loop.dt, 0, (), loop.method, loop.substeps)
    return run, plan, built.scenario.precision


def _grouped(prepared: Sequence[tuple[Run, Plan, str]]) -> list[Group]:
    groups: dict[Any, Group] = {}
    for number, (run, plan, precision) in enumerate(prepared):
        group = groups.setdefault((structure(run), plan, precision), Group(run, plan, precision, [], []))
        group.members.append(number)
        group.numbers.append([np.asarray(leaf) for leaf in jax.tree.leaves(run) if eqx.is_array(leaf)])
    return list(groups.values())


def _program(group: Group) -> tuple[Any, list[bool]]:
    """Program of a group, and which of its numbers are equal in all runs."""
    columns = list(zip(*group.numbers, strict=True))
    shared = [len(column) > 1 and all(np.array_equal(column[0], one) for one in column[1:]) for column in columns]
    try:
        return simd_batch.BatchRunner(group.first, group.plan, shared, runs=len(group.members)), shared
    except simd_batch.Unsupported:
        return vmap_batch.BatchRunner(group.first, group.plan), shared


def _run(group: Group, program: Any, shared: Sequence[bool], part: np.ndarray) -> list[Judged]:
    tree = jax.tree.structure(eqx.filter(group.first, eqx.is_array))
    columns = zip(*(group.numbers[place] for place in part), strict=True)
    outcome = program.run(jax.tree.unflatten(tree, [np.stack(column) for column in columns]))
    backend = "simd" if isinstance(program, simd_batch.BatchRunner) else "xla"
    return [_judged(outcome, place, group.plan.steps, backend) for place in range(len(part))]


def _judged(several: Outcome, place: int, steps: int, backend: str) -> Judged:
    one = jax.tree.map(lambda leaf: np.asarray(leaf)[place], several._replace(time=(), signals=()))
    leaves = [np.asarray(leaf) for leaf in jax.tree.leaves(one)]
    digest = hashlib.sha256(b"".join(leaf.tobytes() for leaf in leaves)).hexdigest()[:16]
    final = [np.asarray(leaf) for leaf in jax.tree.leaves(one.final)]
    finite = all(bool(np.isfinite(leaf).all()) for leaf in final if np.issubdtype(leaf.dtype, np.inexact))
    status = Status(int(one.status))
    supervised = state_in(one.final[1])
    state = "" if supervised is None else state_of(int(supervised.state)).name
    changes = () if supervised is None else tuple(transitions(supervised.log))
    alarms = 0 if supervised is None else max(0, int(supervised.log.number) - _BEGINNING)
    return Judged(status, state, changes, alarms, float(one.ended), one.accumulated[0], finite, steps, digest, backend)
