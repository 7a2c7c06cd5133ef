"""The sampled loop for many runs by `jax.vmap`: for what `simd_batch` cannot do."""

from collections.abc import Callable
from functools import partial
from typing import Any

import equinox as eqx

from simdjit.batches import batched
from undertow.loop import sampled
from undertow.loop.simd_batch import Ended, Plan, Run


class BatchRunner:
    """Runs of one kind, compiled once; `run` runs them, given their arrays with a leading axis over runs.

    Args:
        run: one of them.
        plan: how they are run.
        width: at once; the usual number unless given.
    """

    def __init__(self, run: Run, plan: Plan, width: int = 0):
        numbers, rest = eqx.partition(run, eqx.is_array)
        self.run: Callable[[Any], Ended] = batched(partial(_one, rest, plan), numbers, width)


def _one(rest: Any, plan: Plan, numbers: Any) -> Ended:
    loop, accumulators, (position, velocity), key = eqx.combine(numbers, rest)
    outcome = sampled.simulate(
        loop,
        duration=plan.steps * plan.dt,
        dt=plan.dt,
        key=key,
        position=position,
        velocity=velocity,
        record_every=plan.every,
        accumulators=accumulators,
        method=plan.method,
        substeps=plan.substeps,
    )
    series = {name: outcome.signals[name] for name in plan.signals}
    ending = outcome.status, outcome.ended, outcome.input
    return Ended(outcome.accumulated, outcome.final, *ending, outcome.time, series)
