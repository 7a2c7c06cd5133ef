"""The continuous loop with adaptive steps that meet every jump of the disturbance: the reference for all others."""

from typing import Any, cast

import diffrax
import equinox as eqx
import jax
import jax.numpy as jnp
from jax.flatten_util import ravel_pytree

from undertow.core.status import Status
from undertow.loop.one_ode import blamed, flow
from undertow.loop.outcome import Outcome, going, status_of

_MAX_STEPS = 2**20
_FIRST_STEP = 1e-4  # s; the integrator finds its own from there


@eqx.filter_jit
def solve(loop, key, start, times, until, jumps, rtol, atol) -> Outcome:
    """Integrate from `start` to `until` (s) with records at `times` (s); arguments as in `continuous.simulate`."""
    realization = loop.realize(key)
    # One flat vector: the integrator's own arithmetic is then compiled once, not once per piece of state.
    flat, unravel = ravel_pytree(realization.start(*start))

    def flat_flow(t, flat, realization):
        return ravel_pytree(flow(t, unravel(flat), realization))[0]

    def is_not_finite(t, y, args, **_):
        return status_of(args.loop, *unravel(y)) != int(Status.OK)

    solution = diffrax.diffeqsolve(
        diffrax.ODETerm(flat_flow),
        diffrax.Tsit5(),
        t0=0.0,
        t1=until,
        dt0=_FIRST_STEP,
        y0=flat,
        args=realization,
        saveat=diffrax.SaveAt(subs=(diffrax.SubSaveAt(ts=times), diffrax.SubSaveAt(t1=True))),
        stepsize_controller=diffrax.ClipStepSizeController(diffrax.PIDController(rtol=rtol, atol=atol), jump_ts=jumps),
        event=diffrax.Event(is_not_finite),
        max_steps=_MAX_STEPS,
        throw=False,
    )
    (states, final), (_, ended) = cast(tuple[Any, Any], solution.ys), cast(tuple[Any, Any], solution.ts)
    code = status_of(loop, *unravel(final[0]))
    out_of_steps = (solution.result != diffrax.RESULTS.successful) & (code == int(Status.OK))
    status = jnp.where(out_of_steps, int(Status.STEPS_EXHAUSTED), code)
    last = jnp.maximum(jnp.isfinite(states).all(axis=1).sum() - 1, 0)  # what was never saved is infinite
    index = jnp.minimum(jnp.arange(times.shape[0]), last)
    samples = jax.lax.map(lambda at: realization.record(at[0], *unravel(at[1])), (times[index], states[index]))
    sound = jnp.where(status == int(Status.OK), final[0], states[last])
    ending = blamed(
        going()._replace(status=status, time=ended[0]), realization, ended[0], unravel(final[0]), _FIRST_STEP
    )
    return Outcome(times, samples, (), unravel(sound), *ending)
