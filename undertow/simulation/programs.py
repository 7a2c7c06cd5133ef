"""Groups of runs that one compiled program computes, and the programs."""

import threading
from collections.abc import Callable, Iterable
from typing import Any, NamedTuple

import jax.numpy as jnp
import numpy as np

from undertow.core import runtime
from undertow.core.kept_loops import decides_structure
from undertow.simulation.loop.batch_runner import BatchRunner
from undertow.simulation.loop.loop_runs import RunPlan, numbers_of, structure, with_numbers
from undertow.simulation.loop.simd_batch import simd_width
from undertow.simulation.prepared_run import PreparedRun, RunBatch, batch_of

Runs = Iterable[PreparedRun | RunBatch]


class ProgramKey(NamedTuple):
    """What runs of one program share; they may differ in the number of steps."""

    structure: Any
    plan: RunPlan
    backend: str
    precision: str


class RunGroup(NamedTuple):
    """Runs of one program.

    Attributes:
        key: what they share.
        first: a run of their kind with the largest number of steps; numbers that all share are those of this run.
        places: of the runs among all that were given.
        steps: of each run.
        numbers: in the order of `numbers_of`, with a leading axis over runs; None for those that all share.
        narrow: whether the program is for these runs alone, and need not be wider than they are.
    """

    key: ProgramKey
    first: PreparedRun
    places: np.ndarray
    steps: np.ndarray
    numbers: list[np.ndarray | None]
    narrow: bool

    def numbers_of_runs(self, rows: np.ndarray) -> list[np.ndarray]:
        """All numbers of some of the runs, with a leading axis over these."""
        repeated = lambda leaf: np.broadcast_to(np.asarray(leaf), (len(rows), *np.shape(leaf)))
        pairs = zip(numbers_of(self.first.run), self.numbers, strict=True)
        return [repeated(leaf) if column is None else column[rows] for leaf, column in pairs]


class _Collector:
    """Collects the runs of one program; of numbers that are equal in all of them only one copy is kept."""

    def __init__(self, batch: RunBatch, shared: list[Any]):
        self._first, self.shared = batch.first, list(shared)
        self._columns: list[list[np.ndarray]] = [[] for _ in shared]
        self._places: list[np.ndarray] = []
        self._steps: list[np.ndarray] = []
        self.count = 0

    def add(self, batch: RunBatch, first_place: int) -> None:
        """Add runs whose places begin at a number."""
        pairs = zip(numbers_of(batch.first.run), batch.numbers, strict=True)
        for number, (leaf, varying) in enumerate(pairs):
            shared, column = self.shared[number], self._columns[number]
            if shared is not None and not _equal(shared, leaf, varying):
                # The runs so far have it, these do not.
                column.append(np.broadcast_to(np.array(shared), (self.count, *np.shape(shared))))
                self.shared[number] = shared = None
            if shared is None:
                # Copies: views would keep JAX's arrays, and those ten times the memory.
                column.append(np.repeat(np.array(leaf)[None], batch.size, axis=0) if varying is None else varying)
        self._places.append(np.arange(first_place, first_place + batch.size))
        self._steps.append(np.full(batch.size, batch.first.plan.steps))
        self.count += batch.size

    def group(self, key: ProgramKey, narrow: bool) -> RunGroup:
        """All of them."""
        steps = np.concatenate(self._steps)
        numbers = [
            None if shared is not None else np.concatenate(column)
            for shared, column in zip(self.shared, self._columns, strict=True)
        ]
        with runtime.in_precision(self._first.precision):
            leaves = [
                leaf if shared is None else jnp.asarray(shared)
                for leaf, shared in zip(numbers_of(self._first.run), self.shared, strict=True)
            ]
        if self.count == 1 and narrow:  # as a run by itself, whose program serves others of its kind
            numbers = [None if decides_structure(leaf) else np.array(leaf)[None] for leaf in leaves]
        plan = self._first.plan._replace(steps=int(steps.max()))
        first = self._first._replace(run=with_numbers(self._first.run, leaves), plan=plan)
        return RunGroup(key, first, np.concatenate(self._places), steps, numbers, narrow)


class ProgramCache:
    """Compiled programs, shared by any number of threads.

    Numbers that all runs of a program share become constants of it, which makes it short. No bit of a result depends on
    which ones do. Where later runs differ in one of them, the program is compiled anew without that constant.

    Args:
        probes: some runs of those to come: numbers that are equal in all probes of a structure are taken for constants.
            Without probes, they are those that the runs of a call share.
        xla_width: runs at once of programs by XLA; the usual number unless given.
        gpu: whether a GPU runs them where there is one.
    """

    def __init__(self, probes: Callable[[], Runs] | None = None, xla_width: int = 0, gpu: bool = False):
        self._probes, self._xla_width, self._gpu = probes, xla_width, gpu
        self._shared: dict[Any, list[Any]] | None = None  # by structure
        # With their constants, None for what is none.
        self._runners: dict[ProgramKey, tuple[list[Any], BatchRunner]] = {}
        self._lock = threading.Lock()
        self._compiling: dict[ProgramKey, threading.Lock] = {}

    def groups(self, runs: Runs) -> list[RunGroup]:
        """Runs by the program that computes them."""
        collectors = _collected(runs, _key_of, self._expected_constants)
        if self._probes is not None:
            self._correct(collectors)
        return [collector.group(key, narrow=self._probes is None) for key, collector in collectors.items()]

    def runner(self, group: RunGroup) -> BatchRunner:
        """The program of a group, compiled unless there is one whose constants are those of the group.

        Raises:
            Unsupported: as of `BatchRunner`.
        """
        pairs = zip(numbers_of(group.first.run), group.numbers, strict=True)
        constants = [leaf if column is None else None for leaf, column in pairs]
        with self._lock:
            compiling = self._compiling.setdefault(group.key, threading.Lock())
        with compiling:
            if group.key in self._runners:
                previous, runner = self._runners[group.key]
                constants = [_both(old, new) for old, new in zip(previous, constants, strict=True)]
                if all(old is None or new is not None for old, new in zip(previous, constants, strict=True)):
                    return runner
            runner = self._compiled(group, [constant is not None for constant in constants])
            self._runners[group.key] = constants, runner
            return runner

    def _compiled(self, group: RunGroup, constant: list[bool]) -> BatchRunner:
        count = len(group.places)
        # For one run a program of width one is faster than one of width eight.
        width = min(simd_width(64), 1 << (count - 1).bit_length()) if group.narrow else 0
        first = group.first
        options = {"xla_width": self._xla_width, "gpu": self._gpu}
        return BatchRunner(first.run, first.plan, constant, backend=first.backend, runs=count, width=width, **options)

    def _expected_constants(self, batch: RunBatch) -> list[Any]:
        """Numbers that all runs like those of a batch are expected to share; None for the others."""
        if self._probes is None:
            return _numbers_of_first(batch)
        return self._shared_by_probes().get(structure(batch.first.run), [None] * len(batch.numbers))

    def _shared_by_probes(self) -> dict[Any, list[Any]]:
        assert self._probes is not None
        with self._lock:
            if self._shared is None:
                collectors = _collected(self._probes(), lambda first: structure(first.run), _numbers_of_first)
                self._shared = {form: collector.shared for form, collector in collectors.items() if collector.count > 1}
            return self._shared

    def _correct(self, collectors: dict[ProgramKey, _Collector]) -> None:
        """Numbers in which runs have turned out to differ from the probes are constants no more."""
        shared = self._shared_by_probes()
        with self._lock:
            for key, collector in collectors.items():
                if key.structure in shared:
                    pairs = zip(shared[key.structure], collector.shared, strict=True)
                    shared[key.structure] = [None if new is None else old for old, new in pairs]


def _collected(
    runs: Runs, key_of: Callable[[PreparedRun], Any], shared_of: Callable[[RunBatch], list[Any]]
) -> dict[Any, _Collector]:
    """Runs by a key; `shared_of` are numbers that all runs like those of a batch may share."""
    collectors: dict[Any, _Collector] = {}
    total = 0
    for item in runs:
        batch = batch_of(item) if isinstance(item, PreparedRun) else item
        key = key_of(batch.first)
        if key not in collectors:
            collectors[key] = _Collector(batch, shared_of(batch))
        collectors[key].add(batch, total)
        total += batch.size
    return collectors


def _key_of(first: PreparedRun) -> ProgramKey:
    return ProgramKey(structure(first.run), first.plan._replace(steps=0), first.backend, first.precision)


def _numbers_of_first(batch: RunBatch) -> list[Any]:
    """Numbers of the first run of a batch."""
    pairs = zip(numbers_of(batch.first.run), batch.numbers, strict=True)
    return [leaf if varying is None else varying[0] for leaf, varying in pairs]


def _equal(shared: Any, leaf: Any, varying: np.ndarray | None) -> bool:
    """Whether all runs of a batch have a number."""
    if varying is not None:
        return bool((varying == np.asarray(shared)).all())
    return leaf is shared or np.array_equal(leaf, shared)


def _both(constant: Any, other: Any) -> Any:
    """A constant of both of two programs; None where one of them has another number, or reads it."""
    if constant is None or other is None:
        return None
    return other if other is constant or np.array_equal(constant, other) else None
