"""Trials flown many at once: those that differ in their numbers only share a compiled program."""

import contextlib
import threading
from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import equinox as eqx
import jax
import numpy as np

from undertow.analysis.metrics import OVERALL, Metrics, overall
from undertow.core.status import Status
from undertow.lanes import nvidia
from undertow.lanes.errors import Unsupported
from undertow.loop import in_lanes, vmapped
from undertow.loop.in_lanes import Plan, Run
from undertow.scenario.build import Built
from undertow.scenario.workshop import structure

_STARTS = ("position", "velocity")


class Flown(NamedTuple):
    """What is kept of trials, one entry each."""

    metrics: dict[str, np.ndarray]  # over the steady window; NaN where a run did not last
    status: np.ndarray
    ended: np.ndarray  # s
    series: dict[str, np.ndarray]  # (trials, records, ...)


class _Kind(NamedTuple):
    """What trials of one program have in common."""

    structure: Any
    plan: Plan
    usual: bool  # numbers that were the same in all probes are the same here
    engine: str


class Hangar:
    """Programs that were compiled, for any number of threads.

    Args:
        probes: some trials; numbers that are the same in all of one structure are built into its program. Which
            program flies a trial is then a matter of the campaign, not of the task that it is in.
    """

    def __init__(self, probes: Callable[[], Sequence[Built]]):
        self._probes = probes
        self._common: dict[Any, list[np.ndarray | None]] | None = None
        self._programs: dict[_Kind, Any] = {}
        self._lock = threading.Lock()

    def fly(self, built: Sequence[Built], signals: tuple[str, ...] = (), every: float = 0.0) -> Flown:
        """Run trials; those of one kind together.

        Args:
            built: the trials, sampled loops.
            signals: of which series are kept.
            every: time between their records, s.
        """
        if not built:
            return Flown(dict.fromkeys(OVERALL, np.zeros(0)), np.zeros(0, dtype=np.int8), np.zeros(0), {})
        runs = [_run(one) for one in built]
        kinds: dict[_Kind, list[int]] = {}
        for i, (one, run) in enumerate(zip(built, runs, strict=True)):
            kinds.setdefault(self._kind(run, _plan(one, signals, every), one.scenario.loop.engine), []).append(i)
        pieces = [self._together(kind, [runs[i] for i in members]) for kind, members in kinds.items()]
        back = np.argsort([i for members in kinds.values() for i in members])
        return jax.tree.map(lambda *parts: np.concatenate(parts)[back], *pieces)

    def _together(self, kind: _Kind, runs: list[Run]) -> Flown:
        with self._lock:
            common = (kind.usual and self._commons().get(kind.structure)) or [None] * len(_leaves(runs[0]))
            if kind not in self._programs:
                self._programs[kind] = _program(runs[0], kind, [shared is not None for shared in common])
        columns = zip(common, *map(_leaves, runs), strict=True)
        stacked = jax.tree.unflatten(
            jax.tree.structure(eqx.filter(runs[0], eqx.is_array)),
            [
                np.stack(column) if shared is None else np.broadcast_to(shared, (len(runs), *np.shape(shared)))
                for shared, *column in columns
            ],
        )
        flown = self._programs[kind].fly(stacked)
        lasted = flown.status == int(Status.OK)
        metrics = {name: np.where(lasted, value, np.nan) for name, value in overall(flown.accumulated[0]).items()}
        return Flown(metrics, flown.status.astype(np.int8), flown.ended, flown.series)

    def _kind(self, run: Run, plan: Plan, engine: str) -> _Kind:
        form = structure(run)
        with self._lock:
            common = self._commons().get(form)
        usual = common is not None and all(
            shared is None or leaf is shared or np.array_equal(leaf, shared)
            for leaf, shared in zip(_leaves(run), common, strict=True)
        )
        return _Kind(form, plan, usual, engine)

    def _commons(self) -> dict[Any, list[np.ndarray | None]]:
        """Numbers that all probes of a structure share, by structure: None for those that differ."""
        if self._common is None:
            probes: dict[Any, list[list[Any]]] = {}
            for built in self._probes():
                run = _run(built)
                probes.setdefault(structure(run), []).append(_leaves(run))
            same = lambda column: all(np.array_equal(column[0], other) for other in column[1:])
            self._common = {
                form: [column[0] if same(column) else None for column in zip(*several, strict=True)]
                for form, several in probes.items()
                if len(several) > 1
            }
        return self._common


def _program(run: Run, kind: _Kind, constant: list[bool]) -> in_lanes.Fleet | vmapped.Fleet:
    if kind.engine == "lanes":
        for driver in dict.fromkeys((nvidia.gpu(), None)):
            with contextlib.suppress(Unsupported):
                return in_lanes.Fleet(run, kind.plan, constant, driver=driver)
    return vmapped.Fleet(run, kind.plan)


def _leaves(run: Run) -> list[Any]:
    return [leaf for leaf in jax.tree.leaves(run) if eqx.is_array(leaf)]


def _run(built: Built) -> Run:
    scenario = built.scenario
    start = built.closed_loop.outputs_at_start(*(getattr(scenario.initial, name) for name in _STARTS))
    return Run(built.closed_loop, (Metrics(*built.window()),), start, jax.random.PRNGKey(scenario.seed))


def _plan(built: Built, signals: tuple[str, ...], every: float) -> Plan:
    loop = built.scenario.loop
    record = round(every / loop.dt) if signals else 0
    return Plan(round(loop.duration / loop.dt), loop.dt, record, signals, loop.method, loop.substeps)
