"""Trials flown many at once: loops that differ in their numbers only, stacked, one per lane of one compiled program."""

import threading
from collections.abc import Sequence
from functools import partial
from typing import Any, NamedTuple

import equinox as eqx
import jax
import numpy as np

from undertow.analysis.metrics import OVERALL, Metrics, overall
from undertow.core.status import Status
from undertow.loop import sampled
from undertow.scenario.build import Built
from undertow.scenario.workshop import structure

# Lanes of a program. Its width decides about the last bits of a result, who flies in the other lanes does not: every
# program has this width, however few trials there are, so that no result depends on how they are cut into tasks.
LANES = 64

_STARTS = ("position", "velocity")


class Plan(NamedTuple):
    """What a program is compiled for, beside the structure of its loops."""

    duration: float
    dt: float
    record_every: int  # ticks; 0 for no series
    signals: tuple[str, ...]
    method: str
    substeps: int


class Flown(NamedTuple):
    """What is kept of trials, one entry each."""

    metrics: dict[str, np.ndarray]  # over the steady window; NaN where a run did not last
    status: np.ndarray
    ended: np.ndarray  # s
    series: dict[str, np.ndarray]  # (trials, records, ...)


class Hangar:
    """Programs that were compiled, for any number of threads."""

    def __init__(self) -> None:
        self._programs: dict[Any, Any] = {}
        self._lock = threading.Lock()

    def fly(self, built: Sequence[Built], signals: tuple[str, ...] = (), every: float = 0.0) -> Flown:
        """Run trials; those of one structure together.

        Args:
            built: the trials, sampled loops.
            signals: of which series are kept.
            every: time between their records, s.
        """
        if not built:
            return Flown(dict.fromkeys(OVERALL, np.zeros(0)), np.zeros(0, dtype=np.int8), np.zeros(0), {})
        loops = [_arguments(one) for one in built]
        kinds: dict[Any, list[int]] = {}
        for i, (one, loop) in enumerate(zip(built, loops, strict=True)):
            kinds.setdefault((structure(loop), _plan(one, signals, every)), []).append(i)
        pieces, order = [], []
        for kind, members in kinds.items():
            for first in range(0, len(members), LANES):
                some = members[first : first + LANES]
                pieces.append(self._lanes(kind, [loops[i] for i in some]))
                order += some
        back = np.argsort(order)
        return jax.tree.map(lambda *parts: np.concatenate(parts)[back], *pieces)

    def _lanes(self, kind: tuple[Any, Plan], loops: list[Any]) -> Flown:
        """At most `LANES` runs of one kind; idle lanes fly the last one again."""
        count = len(loops)
        together = [*loops, *[loops[-1]] * (LANES - count)]
        numbers = [eqx.filter(loop, eqx.is_array) for loop in together]
        stacked = jax.tree.map(lambda *leaves: np.stack(leaves), *numbers)
        rest = eqx.filter(loops[0], eqx.is_array, inverse=True)
        with self._lock:
            if kind not in self._programs:
                program = jax.jit(jax.vmap(partial(_run, rest, kind[1])))
                self._programs[kind] = program.lower(stacked).compile()
        state, status, ended, series = jax.tree.map(np.asarray, self._programs[kind](stacked))
        lasted = status == int(Status.OK)
        metrics = {name: np.where(lasted, value, np.nan) for name, value in overall(state).items()}
        return jax.tree.map(lambda leaf: leaf[:count], Flown(metrics, status.astype(np.int8), ended, series))


def _arguments(built: Built) -> Any:
    """Everything of a trial that is a number of its run: loop, window, start and key."""
    scenario = built.scenario
    start = built.closed_loop.outputs_at_start(*(getattr(scenario.initial, name) for name in _STARTS))
    return built.closed_loop, Metrics(*built.window()), start, jax.random.PRNGKey(scenario.seed)


def _plan(built: Built, signals: tuple[str, ...], every: float) -> Plan:
    loop = built.scenario.loop
    record = round(every / loop.dt) if signals else 0
    return Plan(loop.duration, loop.dt, record, signals, loop.method, loop.substeps)


def _run(rest: Any, plan: Plan, numbers: Any):
    loop, metrics, (position, velocity), key = eqx.combine(numbers, rest)
    outcome = sampled.simulate(
        loop,
        duration=plan.duration,
        dt=plan.dt,
        key=key,
        position=position,
        velocity=velocity,
        record_every=plan.record_every,
        accumulators=(metrics,),
        method=plan.method,
        substeps=plan.substeps,
    )
    series = {name: getattr(outcome.samples, name) for name in plan.signals}
    return outcome.accumulated[0], outcome.status, outcome.ended, series
