"""The continuous loop: plant and law as one ODE, the paper's own setting."""

import math
from typing import Any, cast

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float, PRNGKeyArray

from undertow.core.continuous import AbstractContinuousController
from undertow.core.errors import BadInput
from undertow.loop.closed_loop import ClosedLoop
from undertow.loop.one_ode import blamed, flow
from undertow.loop.outcome import Outcome, going
from undertow.loop.recording import freeze_on_failure, instant, record
from undertow.numerics.integrators import rk4_compact


def simulate(
    loop: ClosedLoop,
    *,
    duration: float,
    record_step: float = 1e-2,
    key: PRNGKeyArray | None = None,
    position: Any = None,
    velocity: Any = None,
    dt: float = 1e-3,
    tolerances: tuple[float, float] | None = None,
) -> Outcome:
    """Integrate plant and law together.

    Args:
        loop: the five roles; the controller must be written in continuous time.
        duration: s; with fixed steps rounded to whole ones.
        record_step: time between records, s; with fixed steps a multiple of dt.
        key: for everything random; None for key 0.
        position, velocity: outputs at t = 0; None for zero.
        dt: fixed step of the classical Runge-Kutta method, s. Jumps of the disturbance are met if they fall on it.
        tolerances: relative and absolute, for adaptive steps that meet every jump, instead of fixed ones.

    Returns:
        Outcome; records after a failure repeat the last sound state.

    Raises:
        BadInput: duration, record_step or dt not positive, or as `check`.
    """
    check(loop)
    loop = loop.starting_at(position)
    # As many records as fit; what a division of whole multiples leaves over does not count.
    records = math.floor(duration / record_step * (1 + 1e-9)) if 0 < duration < math.inf and record_step > 0 else 0
    if records < 1:
        raise BadInput("duration", f"be at least one record ({record_step:g} s)", f"{duration:g} s")
    key = jax.random.PRNGKey(0) if key is None else key
    start = loop.outputs_at_start(position, velocity)
    if tolerances is not None:
        from undertow.loop.adaptive import solve

        times = jnp.asarray(np.arange(records + 1) * record_step, dtype=float)
        until = jnp.maximum(times[-1], duration)
        jumps = jnp.asarray([0.0, *loop.disturbance.jumps(duration)])
        return solve(loop, key, start, times, until, jumps, *tolerances)
    if not 0 < dt <= record_step * (1 + 1e-9):
        raise BadInput("dt", f"be positive and at most one record ({record_step:g} s)", f"{dt:g} s")
    every = round(record_step / dt)
    dt = record_step / every
    return _run(loop, key, start, jnp.asarray(dt, dtype=float), (round(duration / dt), every))


def check(loop: ClosedLoop) -> None:
    """Whether a closed loop can be one ODE.

    Raises:
        BadInput: a law that exists only sampled, or a sensor that is not smooth.
    """
    for obstacle, what in (
        (not isinstance(loop.controller, AbstractContinuousController), "controller, which exists only sampled"),
        (not loop.navigation.smooth, "navigation, whose noise is new at every sample"),
    ):
        if obstacle:
            raise BadInput("kind", f"be sampled with this {what}", "continuous")


@eqx.filter_jit
def _run(loop: ClosedLoop, key, start, dt: Float[Array, ""], plan: tuple[int, int]) -> Outcome:
    steps, every = plan
    realization, controller = loop.realize(key), cast(AbstractContinuousController, loop.controller)

    def control_step(carry, k):
        state, ending = carry
        t = instant(k, dt)
        x, z = rk4_compact(lambda s, state: flow(s, state, realization), t, state, dt)
        return freeze_on_failure(loop, state, (x, controller.project(z)), ending, t, dt)

    (final, ending), (time, samples) = record(
        realization, control_step, (realization.start(*start), going()), dt, steps, every
    )
    ending = blamed(ending, realization, ending.time - dt, final, dt)  # where the step that failed began
    return Outcome(time, samples, (), final, *ending.until(instant(steps, dt)))
