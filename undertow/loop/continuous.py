"""The continuous loop: plant and law as one ODE, the paper's own setting and the reference for the sampled loop."""

from typing import Any, cast

import diffrax
import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float, PRNGKeyArray

from undertow.core.continuous import AbstractContinuousController
from undertow.core.errors import BadInput
from undertow.core.status import Status
from undertow.loop.closed_loop import ClosedLoop, Drawn
from undertow.loop.outcome import Outcome, health

_MAX_STEPS = 2**20
_FIRST_STEP = 1e-4  # s; the integrator finds its own from there


def simulate(
    loop: ClosedLoop,
    *,
    duration: float,
    record_step: float = 1e-2,
    key: PRNGKeyArray | None = None,
    position: Any = None,
    velocity: Any = None,
    rtol: float = 1e-8,
    atol: float = 1e-9,
) -> Outcome:
    """Integrate plant and law together, with adaptive steps that meet every jump of the disturbance.

    Args:
        loop: the five roles; the controller must be written in continuous time.
        duration: s; rounded to whole records.
        record_step: time between records, s.
        key: for everything random; None for key 0.
        position, velocity: outputs at t = 0; None for zero.
        rtol, atol: tolerances of the integrator.

    Returns:
        Outcome; records after a failure repeat the last sound one.

    Raises:
        BadInput: duration or record_step not positive, or as `check`.
    """
    check(loop)
    records = round(duration / record_step) if 0 < duration < float("inf") and record_step > 0 else 0
    if records < 1:
        raise BadInput("duration", f"be at least one record ({record_step:g} s)", f"{duration:g} s")
    key = jax.random.PRNGKey(0) if key is None else key
    start = loop.outputs_at_start(position, velocity)
    times = jnp.asarray(np.arange(records + 1) * record_step, dtype=float)
    jumps = jnp.asarray([0.0, *loop.disturbance.jumps(duration)])
    return _run(loop, key, start, times, times[-1], jumps, rtol, atol)


def check(loop: ClosedLoop) -> None:
    """Whether a closed loop can be one ODE.

    Raises:
        BadInput: a law that exists only sampled, or a sensor that is not smooth.
    """
    for obstacle, what in (
        (not isinstance(loop.controller, AbstractContinuousController), "controller, which exists only sampled"),
        (not loop.sensor.smooth, "sensor, whose noise is new at every sample"),
    ):
        if obstacle:
            raise BadInput("kind", f"be sampled with this {what}", "continuous")


@eqx.filter_jit
def _run(loop, key, start, times, duration, jumps, rtol, atol) -> Outcome:
    drawn = loop.draw(key)
    solution = diffrax.diffeqsolve(
        diffrax.ODETerm(_flow),
        diffrax.Tsit5(),
        t0=0.0,
        t1=duration,
        dt0=_FIRST_STEP,
        y0=drawn.start(*start),
        args=drawn,
        saveat=diffrax.SaveAt(subs=(diffrax.SubSaveAt(ts=times), diffrax.SubSaveAt(t1=True))),
        stepsize_controller=diffrax.ClipStepSizeController(diffrax.PIDController(rtol=rtol, atol=atol), jump_ts=jumps),
        event=diffrax.Event(_is_unsound),
        max_steps=_MAX_STEPS,
        throw=False,
    )
    states, final = cast(tuple[Any, Any], solution.ys)
    ended = cast(tuple[Array, Array], solution.ts)[1][0]
    code = health(loop.plant, *jax.tree.map(lambda leaf: leaf[0], final))
    out_of_steps = (solution.result != diffrax.RESULTS.successful) & (code == int(Status.OK))
    status = jnp.where(out_of_steps, int(Status.STEPS_EXHAUSTED), code)
    last = jnp.maximum(jnp.sum(times <= ended) - 1, 0)
    index = jnp.minimum(jnp.arange(times.shape[0]), last)
    held = jax.tree.map(lambda leaf: leaf[index], states)
    samples = jax.vmap(lambda t, state: _sample(drawn, t, state))(times[index], held)
    return Outcome(times, samples, (), jax.tree.map(lambda leaf: leaf[0], final), status, ended)


@jax.jit  # traced once, although the integrator's stages call it many times
def _flow(t: Float[Array, ""], state, drawn: Drawn):
    x, z = state
    controller = cast(AbstractContinuousController, drawn.loop.controller)
    decision = drawn.decide(t, x, z)
    x_rate = drawn.loop.plant.dynamics(t, x, decision.applied, drawn.load(t))
    return x_rate, controller.flow(z, decision.y, decision.r, decision.applied)


def _is_unsound(t, y, args: Drawn, **_):
    return health(args.loop.plant, *y) != int(Status.OK)


def _sample(drawn: Drawn, t, state):
    x, z = state
    return drawn.sample(t, x, drawn.decide(t, x, z))
