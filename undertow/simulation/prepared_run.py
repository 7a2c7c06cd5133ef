"""Runs of closed loops as a batch can hold them."""

from typing import NamedTuple

import numpy as np

from undertow.core.numerics.random_keys import key_of_seed
from undertow.core.runtime import current_precision
from undertow.simulation.loop.closed_loop import ClosedLoop
from undertow.simulation.loop.loop_runs import LoopRun, RunPlan, numbers_of
from undertow.simulation.loop.sampled import AbstractAccumulator


class PreparedRun(NamedTuple):
    """One run: what runs, how, by which backend ("simd" or "xla") and in which precision."""

    run: LoopRun
    plan: RunPlan
    backend: str = "simd"
    precision: str = "float64"


class RunBatch(NamedTuple):
    """Runs that differ only in numbers.

    Attributes:
        first: one of them.
        numbers: in the order of `numbers_of`, with a leading axis over runs; None for those that all have of `first`.
        size: how many.
    """

    first: PreparedRun
    numbers: list[np.ndarray | None]
    size: int


def batch_of(run: PreparedRun) -> RunBatch:
    """A batch of one run."""
    return RunBatch(run, [None] * len(numbers_of(run.run)), 1)


def prepare_loop(
    loop: ClosedLoop, plan: RunPlan, seed: int = 0, accumulators: tuple[AbstractAccumulator, ...] = ()
) -> PreparedRun:
    """A closed loop that starts where its reference or plant does, in the precision of this thread."""
    run = LoopRun(loop, accumulators, loop.outputs_at_start(None, None), key_of_seed(seed))
    return PreparedRun(run, plan, precision=current_precision())
