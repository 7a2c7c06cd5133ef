"""Computing time of one step of a controller: the median of many calls of its single compiled step."""

import statistics
import time
from collections.abc import Mapping
from typing import Any, NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np

from undertow.core.contracts import Target
from undertow.scenario.build import Built, in_its_precision
from undertow.simulation.loop.controller_step import first_step, next_step
from undertow.simulation.loop.stepped import CompiledStep

HOW_LONG = (
    "Computing time is the median over the calls of one compiled step of the law alone, on this machine; it differs "
    "from run to run. A step by XLA includes about 100 \u00b5s for the call."
)

_CALLS, _BEFORE = 2000, 200
_LONGEST = 0.5  # s, for the calls of one law


class StepTime(NamedTuple):
    """Time of one control step of a law by itself, without plant and navigation.

    Attributes:
        median: s.
        backend: `simd` or `xla`, see `undertow.simulation.loop.stepped.CompiledStep`.
    """

    median: float
    backend: str


def step_times(built: Mapping[str, Built]) -> dict[str, StepTime]:
    """Time of a step of every law, by name. It depends on the machine and on what else runs there."""
    return {name: step_time(trial) for name, trial in built.items()}


@in_its_precision
def step_time(built: Built) -> StepTime:
    """Time of a step of the law of a scenario, at rest at the origin of the reference."""
    loop, dt = built.closed_loop, built.scenario.loop.dt
    law, plant = loop.controller, loop.plant
    numbers, structure = eqx.partition(law, eqx.is_array)
    copy_arrays = lambda tree: jax.tree.map(lambda leaf: np.array(leaf), tree)
    y = plant.output(jnp.zeros(()), plant.initial_state())
    if law.takes_raw_readings:
        y = y._replace(health=jnp.ones(plant.inputs()))
    target: Target = loop.reference.at(jnp.zeros(()))
    applied = jnp.zeros(plant.inputs())
    interval = jnp.asarray(dt)
    memory, _ = first_step(law, y, target)

    def step(numbers: Any, memory: Any, inputs: Any) -> tuple[Any, Any]:
        measured, desired, was_applied, elapsed = inputs
        return next_step(eqx.combine(numbers, structure), memory, measured, desired, was_applied, elapsed)

    compiled = CompiledStep(
        step, copy_arrays(numbers), copy_arrays(memory), copy_arrays((y, target, applied, interval))
    )
    durations = []
    measurement_start = time.perf_counter()
    for _ in range(_BEFORE):
        compiled()
    while len(durations) < _CALLS and time.perf_counter() - measurement_start < _LONGEST:
        start = time.perf_counter()
        compiled()
        durations.append(time.perf_counter() - start)
    return StepTime(
        statistics.median(durations) if durations else (time.perf_counter() - measurement_start) / _BEFORE,
        compiled.backend,
    )
