"""Runs trials in batches: trials that differ only in numbers share one compiled program."""

import contextlib
import threading
from collections.abc import Callable, Iterable, Sequence
from typing import Any, NamedTuple

import equinox as eqx
import jax
import numpy as np

from undertow.analysis.metrics import accumulators, results_of_batch
from undertow.campaign.campaign_schema import Series
from undertow.core import runtime
from undertow.core.status import Status
from undertow.loop import simd_batch, vmap_batch
from undertow.loop.simd_batch import Plan, Run
from undertow.numerics.random_keys import key_of_seed
from undertow.scenario.build import Built, in_its_precision
from undertow.scenario.part_cache import structure

_STARTS = ("position", "velocity")


@in_its_precision
def run_of(built: Built) -> Run:
    """Loop, accumulators, start and key of a trial."""
    scenario = built.scenario
    start = built.closed_loop.outputs_at_start(*(getattr(scenario.initial, name) for name in _STARTS))
    gathered = accumulators(built.closed_loop.plant, built.metrics, *built.window())
    return Run(built.closed_loop, gathered, start, key_of_seed(scenario.seed))


def planned(built: Built, asked: Series | None) -> Plan:
    """Steps and recorded series of a trial."""
    loop = built.scenario.loop
    every, signals = (round(asked.every / loop.dt), tuple(asked.signals)) if asked else (0, ())
    return Plan(round(loop.duration / loop.dt), loop.dt, every, signals, loop.method, loop.substeps)


def leaves(run: Run) -> list[Any]:
    """The numbers of a trial, in the order of its tree."""
    return [leaf for leaf in jax.tree.leaves(run) if eqx.is_array(leaf)]


def shared_numbers(several: Sequence[Built]) -> dict[Any, list[np.ndarray | None]]:
    """Numbers that are equal in all trials of a structure with at least two trials; None for the others."""
    probes: dict[Any, list[list[Any]]] = {}
    for built in several:
        run = run_of(built)
        probes.setdefault(structure(run), []).append(leaves(run))
    same = lambda column: all(np.array_equal(column[0], other) for other in column[1:])
    return {
        form: [column[0] if same(column) else None for column in zip(*members, strict=True)]
        for form, members in probes.items()
        if len(members) > 1
    }


# Backend of a trial. XLA is slower, and a single run repeats such a trial only up to rounding.
SIMD, XLA = 0, 1


class BatchResult(NamedTuple):
    """Results of trials, one entry per trial."""

    metrics: dict[str, np.ndarray]  # over the steady window; NaN for failed runs and undefined metrics
    status: np.ndarray
    ended: np.ndarray  # s
    backend: np.ndarray  # SIMD or XLA
    series: dict[str, np.ndarray]  # (trials, records, ...)


class Batch(NamedTuple):
    """Trials that differ only in numbers."""

    first: Run
    plan: Plan
    backend: str
    precision: str
    own: list[np.ndarray | None]  # in the order of `leaves`, with a leading axis over trials; None: those of the first
    trials: int


def batch_of(built: Built, asked: Series | None) -> Batch:
    """One trial and the series that are recorded of it."""
    run, scenario = run_of(built), built.scenario
    return Batch(run, planned(built, asked), scenario.loop.backend, scenario.precision, [None] * len(leaves(run)), 1)


class _Kind(NamedTuple):
    """Properties that trials of one program share."""

    structure: Any
    plan: Plan
    usual: bool  # numbers that were the same in all probes are the same here
    backend: str
    precision: str


class _Group(NamedTuple):
    """Trials of one kind in a task."""

    first: Run
    members: list[np.ndarray]  # their indices in the task, of each batch
    numbers: list[list[np.ndarray]]  # the numbers that differ between trials, of each batch


class ProgramCache:
    """Compiled programs, shared by any number of threads.

    Args:
        probes: some trials; numbers that are equal in all probes of one structure become constants of its program. The
            program of a trial then depends on the campaign only, not on the task.
    """

    def __init__(self, probes: Callable[[], Sequence[Built]]):
        self._probes = probes
        self._shared: dict[Any, list[np.ndarray | None]] | None = None
        self._programs: dict[_Kind, Any] = {}
        self._lock = threading.Lock()

    def run(self, batches: Iterable[Batch], asked: Series | None = None) -> BatchResult:
        """Run trials, those of one kind together; only the numbers that differ are kept in memory.

        Args:
            batches: sampled loops; the results are in the order of their trials.
            asked: series that they record.
        """
        groups: dict[_Kind, _Group] = {}
        total = 0
        for batch in batches:
            indices, total = np.arange(total, total + batch.trials), total + batch.trials
            form = structure(batch.first)
            common = self._commons().get(form)
            usual = np.zeros(batch.trials, dtype=bool) if common is None else _equal(batch, common)
            for whether in np.unique(usual):
                kind, chosen = _Kind(form, batch.plan, bool(whether), batch.backend, batch.precision), usual == whether
                group = groups.setdefault(kind, _Group(batch.first, [], []))
                group.members.append(indices[chosen])
                group.numbers.append(_differing(batch, chosen, self._common(kind, len(batch.own))))
        if not groups:  # no trials: the arrays of one trial, cut to length zero
            return jax.tree.map(lambda kept: kept[:0], self.run([batch_of(self._probes()[0], asked)], asked))
        pieces = []
        for kind, group in groups.items():
            with runtime.in_precision(kind.precision):
                pieces.append(self._together(kind, group))
        names = dict.fromkeys(name for piece in pieces for name in piece.metrics)
        # A law or a plant may have no metric of that name.
        defined = lambda piece, name: piece.metrics.get(name, np.full(len(piece.status), np.nan))
        pieces = [piece._replace(metrics={name: defined(piece, name) for name in names}) for piece in pieces]
        back = np.argsort(np.concatenate([some for group in groups.values() for some in group.members]))
        return jax.tree.map(lambda *parts: np.concatenate(parts)[back], *pieces)

    def _together(self, kind: _Kind, group: _Group) -> BatchResult:
        common = self._common(kind, len(leaves(group.first)))
        with self._lock:
            if kind not in self._programs:
                constant = [shared is not None for shared in common]
                self._programs[kind] = _program(group.first, kind, constant, sum(map(len, group.members)))
        count = sum(map(len, group.members))
        own = iter([np.concatenate(parts) for parts in zip(*group.numbers, strict=True)])
        repeated = lambda shared: np.broadcast_to(shared, (count, *np.shape(shared)))
        numbers = [next(own) if shared is None else repeated(shared) for shared in common]
        tree = jax.tree.structure(eqx.filter(group.first, eqx.is_array))
        result = self._programs[kind].run(jax.tree.unflatten(tree, numbers))
        lasted = result.status == int(Status.OK)
        found = results_of_batch(group.first.accumulators, result.accumulated)
        metrics = {name: np.where(lasted, value, np.nan) for name, value in found.items()}
        backend = np.full(
            count, SIMD if isinstance(self._programs[kind], simd_batch.BatchRunner) else XLA, dtype=np.int8
        )
        return BatchResult(metrics, result.status.astype(np.int8), result.ended, backend, result.signals)

    def _common(self, kind: _Kind, count: int) -> list[np.ndarray | None]:
        """Constants of the program of a kind, in the order of the leaves of its runs; None for the other leaves."""
        found = self._commons().get(kind.structure) if kind.usual else None
        return [None] * count if found is None else found

    def _commons(self) -> dict[Any, list[np.ndarray | None]]:
        """Numbers that all probes of a structure share, by structure; None for numbers that differ."""
        with self._lock:
            if self._shared is None:
                self._shared = shared_numbers(self._probes())
            return self._shared


def _equal(batch: Batch, common: list[np.ndarray | None]) -> np.ndarray:
    """Which trials of a batch have these numbers where they are not None."""
    same = np.ones(batch.trials, dtype=bool)
    for shared, own, leaf in zip(common, batch.own, leaves(batch.first), strict=True):
        if shared is not None and own is not None:
            same &= (own == shared).reshape(batch.trials, -1).all(1)
        elif shared is not None and leaf is not shared:
            same &= np.array_equal(leaf, shared)
    return same


def _differing(batch: Batch, chosen: np.ndarray, common: list[np.ndarray | None]) -> list[np.ndarray]:
    """Numbers of the chosen trials of a batch that are no constants of their program."""
    count, found = int(chosen.sum()), []
    for shared, own, leaf in zip(common, batch.own, leaves(batch.first), strict=True):
        if shared is None:
            # Copies: views would keep JAX's arrays, and those ten times the memory.
            found.append(np.repeat(np.array(leaf)[None], count, axis=0) if own is None else own[chosen])
    return found


def _program(run: Run, kind: _Kind, constant: list[bool], runs: int) -> simd_batch.BatchRunner | vmap_batch.BatchRunner:
    if kind.backend == "simd":
        for driver in dict.fromkeys((simd_batch.gpu(), None)):
            with contextlib.suppress(simd_batch.Unsupported):
                return simd_batch.BatchRunner(run, kind.plan, constant, driver=driver, runs=runs)
    return vmap_batch.BatchRunner(run, kind.plan)
