"""The sampled loop for many runs by `jax.vmap`, for runs that `simd_batch` does not support."""

from collections.abc import Callable
from functools import partial
from typing import Any

import equinox as eqx
import jax
import numpy as np

from undertow.simulation.loop import sampled
from undertow.simulation.loop.loop_runs import LoopRun, RunPlan
from undertow.simulation.loop.outcome import Outcome

# The last bits of a result depend on the width of the program, but not on the other runs in it: every program has
# this width, however few runs there are, so that no result depends on how they are divided into tasks.
_WIDTH = 64


class XlaBatchRunner:
    """Runs of one kind, compiled once; `run` takes their arrays with a leading axis over runs.

    Args:
        run: one of them.
        plan: how they are run.
        width: runs at once; the usual number unless given.
    """

    def __init__(self, run: LoopRun, plan: RunPlan, width: int = 0):
        numbers, static = eqx.partition(run, eqx.is_array)
        self.run: Callable[[Any], Outcome] = _batched(partial(_one, static, plan), numbers, width or _WIDTH)


def _batched(function: Callable[[Any], Any], numbers: Any, width: int) -> Callable[[Any], Any]:
    """The function of a tree of arrays with a leading axis over runs, `width` of them at once."""
    stacked = jax.tree.map(lambda leaf: jax.ShapeDtypeStruct((width, *np.shape(leaf)), leaf.dtype), numbers)
    program = jax.jit(jax.vmap(function)).lower(stacked).compile()

    def run(numbers: Any) -> Any:
        runs, pieces = len(jax.tree.leaves(numbers)[0]), []
        for first in range(0, runs, width):
            indices = np.minimum(np.arange(first, first + width), runs - 1)
            results = program(jax.tree.map(lambda leaf, indices=indices: leaf[indices], numbers))
            pieces.append(jax.tree.map(np.asarray, results))
        return jax.tree.map(lambda *parts: np.concatenate(parts)[:runs], *pieces)

    return run


def _one(static: Any, plan: RunPlan, numbers: Any) -> Outcome:
    loop, accumulators, (position, velocity), key = eqx.combine(numbers, static)
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
    return outcome._replace(signals={name: outcome.signals[name] for name in plan.signals})
