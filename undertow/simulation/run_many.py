"""Many runs: those that differ only in numbers share one compiled program, whatever asks for them.

Campaigns, tuning, falsification, the reproduction of the paper and the stress test run their loops here.
"""

import functools
import itertools
import math
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor, as_completed
from typing import Any, NamedTuple

import jax
import numpy as np

from undertow.core import runtime
from undertow.simulation.loop.loop_runs import outcome_of
from undertow.simulation.loop.outcome import Outcome
from undertow.simulation.prepared_run import PreparedRun
from undertow.simulation.programs import ProgramCache, RunGroup, Runs


class BatchResult(NamedTuple):
    """Results of some runs of one program.

    Attributes:
        places: of the runs among all that were given.
        first: a run of their kind, for its loop and accumulators.
        outcome: arrays with a leading axis over these runs.
        backend: what ran them, "simd" or "xla".
        left_to_xla: the reason why XLA ran what the batch compiler was asked for, "" otherwise.
    """

    places: np.ndarray
    first: PreparedRun
    outcome: Outcome
    backend: str
    left_to_xla: str

    def each(self) -> Iterator[tuple[int, Outcome]]:
        """Place and outcome of every run."""
        for row, index in enumerate(self.places.tolist()):
            yield index, outcome_of(self.outcome, row)


def run_many(
    runs: Runs,
    *,
    programs: ProgramCache | None = None,
    workers: int = 1,
    at_once: int | None = None,
    watch: Callable[[int], None] = lambda done: None,
) -> Iterator[BatchResult]:
    """Run closed loops, those that differ only in numbers by one program.

    Args:
        runs: any loops; what they share is found here.
        programs: programs of earlier calls, to use and to add to.
        workers: threads; the results then come in the order in which they are done.
        at_once: runs of one thread whose results are in memory together; without it, those of a program are shared
            evenly among the threads.
        watch: called with the number of runs that have ended.

    Returns:
        Results as they are done, of every run in one of them; see `in_order` and `BatchResult.each`.
    """
    programs = ProgramCache() if programs is None else programs
    pieces = _pieces(programs.groups(runs), workers, at_once)
    done = 0
    tasks = [functools.partial(run_group, group, rows, programs) for group, rows in pieces]
    for batches in _computed(tasks, workers):
        yield from batches
        done += sum(len(batch.places) for batch in batches)
        watch(done)


def run_group(
    group: RunGroup, rows: np.ndarray | None = None, programs: ProgramCache | None = None
) -> list[BatchResult]:
    """Some runs of one program, by this thread; those of one length together.

    Args:
        group: the runs.
        rows: which of them; all unless given.
        programs: programs of earlier calls, to use and to add to.
    """
    results = []
    rows = np.arange(len(group.places)) if rows is None else rows
    with runtime.in_precision(group.first.precision), runtime.on_processor():
        runner = (ProgramCache() if programs is None else programs).runner(group)
        for steps in dict.fromkeys(group.steps[rows].tolist()):
            rows_of_length = rows[group.steps[rows] == steps]
            outcome = runner.run(group.numbers_of_runs(rows_of_length), steps)
            results.append(
                BatchResult(group.places[rows_of_length], group.first, outcome, runner.backend, runner.left_to_xla)
            )
    return results


def run_together(runs: Sequence[PreparedRun], workers: int = 1) -> Outcome:
    """Run loops that differ only in numbers; the outcome has arrays with a leading axis over runs, in their order."""
    batches = list(run_many(runs, workers=workers))
    return in_order(batches, [batch.outcome for batch in batches])


def in_order(batches: Sequence[BatchResult], values: Sequence[Any]) -> Any:
    """Arrays of all runs in the order in which these were given.

    Args:
        batches: all results of a call of `run_many`.
        values: one tree of arrays for each, with a leading axis over its runs.
    """
    back = np.argsort(np.concatenate([batch.places for batch in batches]))
    return jax.tree.map(lambda *parts: np.concatenate(parts)[back], *values)


def _pieces(groups: Sequence[RunGroup], workers: int, at_once: int | None) -> list[tuple[RunGroup, np.ndarray]]:
    """Groups and which of their runs are computed together: the first pieces of all groups, then the second ones.

    So the threads compile different programs, and do not wait for each other.
    """
    pieces_of_groups = []
    for group in groups:
        count = len(group.places)
        parts = max(1, workers // len(groups)) if at_once is None else math.ceil(count / at_once)
        rows_of_pieces = np.array_split(np.arange(count), min(count, parts))
        pieces_of_groups.append([(group, rows) for rows in rows_of_pieces])
    rounds = itertools.zip_longest(*pieces_of_groups)
    return [piece for pieces in rounds for piece in pieces if piece is not None]


def _computed(tasks: Sequence[Callable[[], Any]], workers: int) -> Iterator[Any]:
    """Results of tasks as they are done."""
    if workers == 1 or len(tasks) == 1:
        for task in tasks:
            yield task()
        return
    with ThreadPoolExecutor(workers) as pool:
        try:
            for future in as_completed([pool.submit(task) for task in tasks]):
                yield future.result()
        except BaseException:
            pool.shutdown(wait=False, cancel_futures=True)
            raise
