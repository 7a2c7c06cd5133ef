"""The continuous loop: plant and law as one ODE, as in the paper."""

import math
from functools import partial
from typing import Any, NamedTuple, cast

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jax.flatten_util import ravel_pytree
from jaxtyping import Array, Float, PRNGKeyArray, PyTree

from undertow.core.contracts import AbstractContinuousController, Outputs
from undertow.core.errors import BadInput
from undertow.core.expected_measurement import all_finite
from undertow.core.numerics.integrators import rk4_compact
from undertow.core.status import Status
from undertow.simulation.loop.closed_loop import ClosedLoop, Realization
from undertow.simulation.loop.outcome import Ending, Outcome, running, status_of
from undertow.simulation.loop.recording import freeze_on_failure, instant, record


@jax.jit  # traced once, although an integrator calls it in several places
def flow(t: Float[Array, ""], state: tuple[PyTree, PyTree], realization: Realization) -> tuple[PyTree, PyTree]:
    """Rates of plant state x and controller state z at time t; NaN where the command is not finite."""
    x, z = state
    controller = cast(AbstractContinuousController, realization.loop.controller)
    decision = realization.decide(t, x, z)
    x_rate = realization.motion(t, x, decision.acting)
    commanded = jnp.isfinite(decision.command).all()  # limits and dead zones would hide a NaN
    x_rate = jax.tree.map(lambda rate: jnp.where(commanded, rate, jnp.nan), x_rate)
    return x_rate, controller.flow(z, decision.y, decision.r, decision.applied)


def blamed(
    ending: Ending, realization: Realization, t: Float[Array, ""], state: tuple[PyTree, PyTree], dt: Any
) -> Ending:
    """The ending of a run that stopped with some states at `t` (s); it names a command that is its cause.

    The command is evaluated at the stages of the Runge-Kutta step of dt (s) that failed: start, middle and end.
    """
    rate = flow(t, state, realization)
    for share in (0.0, 0.5, 1.0):
        stage_time = t + share * dt
        ahead = jax.tree.map(lambda now, change, share=share: now + share * dt * change, state, rate)
        at = ahead if share else state
        blame = ending.blamed(realization.decide(stage_time, *at).command, stage_time)
        # A state that a load made non-finite makes every command non-finite.
        ending = Ending(*(jnp.where(all_finite(at), new, old) for new, old in zip(blame, ending, strict=True)))
    return ending


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
        loop: closed loop; the controller must be written in continuous time.
        duration: s; with fixed steps rounded to whole ones.
        record_step: time between records, s; with fixed steps a multiple of dt.
        key: for everything random; None for key 0.
        position, velocity: outputs at t = 0; None for zero.
        dt: fixed step of the classical Runge-Kutta method, s. Jumps of the disturbance are met if they fall on it.
        tolerances: relative and absolute, for adaptive steps that meet every jump, instead of fixed ones.

    Returns:
        Outcome; records after a failure repeat the last valid state.

    Raises:
        BadInput: duration, record_step or dt not positive, or as `check`.
    """
    check(loop)
    loop, records = loop.starting_at(position), records_of(duration, record_step)
    key = jax.random.PRNGKey(0) if key is None else key
    start = loop.outputs_at_start(position, velocity)
    if tolerances is not None:
        times = jnp.asarray(np.arange(records + 1) * record_step, dtype=float)
        until = jnp.maximum(times[-1], duration)
        jumps = jnp.asarray([0.0, *loop.disturbance.jumps(duration)])
        return solve(loop, key, start, times, until, jumps, *tolerances)
    grid = grid_of(duration, record_step, dt)
    outcome = _run(loop, key, start, jnp.asarray(grid.dt, dtype=float), (grid.steps, grid.every))
    return explained(loop, key, outcome, grid.dt)


class Grid(NamedTuple):
    """Fixed steps of a run: how many, how many from record to record, and how long (s)."""

    steps: int
    every: int
    dt: float


def records_of(duration: float, record_step: float) -> int:
    """Number of records after the first one; for arguments and errors see `simulate`."""
    # As many as fit; the rounding error of dividing whole multiples does not count.
    records = math.floor(duration / record_step * (1 + 1e-9)) if 0 < duration < math.inf and record_step > 0 else 0
    if records < 1:
        raise BadInput("duration", f"be at least one record ({record_step:g} s)", f"{duration:g} s")
    return records


def grid_of(duration: float, record_step: float, dt: float) -> Grid:
    """Fixed steps that divide the time between records; for arguments and errors see `simulate`."""
    if not 0 < dt <= record_step * (1 + 1e-9):
        raise BadInput("dt", f"be positive and at most one record ({record_step:g} s)", f"{dt:g} s")
    every = round(record_step / dt)
    dt = record_step / every
    return Grid(round(duration / dt), every, dt)


def check(loop: ClosedLoop) -> None:
    """Check that a closed loop can be one ODE.

    Raises:
        BadInput: the law exists only sampled, the navigation is not smooth, or there are faults.
    """
    for obstacle, what in (
        (not isinstance(loop.controller, AbstractContinuousController), "controller, which exists only sampled"),
        (not loop.navigation.smooth, "navigation, whose noise is new at every sample"),
        (loop.faults is not None, "list of `faults`, which are decided at every sample"),
    ):
        if obstacle:
            raise BadInput("kind", f"be sampled with this {what}", "continuous")


@eqx.filter_jit
def _run(loop: ClosedLoop, key, start, dt: Float[Array, ""], plan: tuple[int, int]) -> Outcome:
    steps, every = plan
    realization = loop.realize(key)
    advance = partial(step, realization, dt)
    (final, _, ending), (time, samples) = record(realization, advance, begin(realization, start), dt, steps, every)
    return Outcome(time, samples, (), final, *ending.until(instant(steps, dt)))


def begin(realization: Realization, start: tuple[Outputs, Outputs]) -> PyTree:
    """Carry before the first fixed step, of the form of `sampled.begin`: nothing is accumulated."""
    return realization.start(*start), (), running()


def step(realization: Realization, dt: Any, carry, k):
    """A fixed step of plant and controller together."""
    state, accumulated, ending = carry
    t, controller = instant(k, dt), cast(AbstractContinuousController, realization.loop.controller)
    x, z = rk4_compact(lambda s, state: flow(s, state, realization), t, state, dt)
    state, ending = freeze_on_failure(realization.loop, state, (x, controller.project(z)), ending, t, dt)
    return state, accumulated, ending


def explained(loop: ClosedLoop, key: PRNGKeyArray, outcome: Outcome, dt: float) -> Outcome:
    """A run of fixed steps of dt (s); one that failed with its cause, for which alone that program is compiled."""
    if int(outcome.status) == int(Status.OK):
        return outcome
    ending = Ending(outcome.status, outcome.ended, outcome.input)
    status, ended, wrong = _cause(loop, key, ending, outcome.final, jnp.asarray(outcome.ended) - dt, dt)
    return outcome._replace(status=status, ended=ended, input=wrong)


@eqx.filter_jit
def _cause(loop: ClosedLoop, key, ending: Ending, last: PyTree, t: Float[Array, ""], dt: Any) -> Ending:
    """The ending of a failed run with its cause: a step of dt (s) from the last valid state, which began at t."""
    return blamed(ending, loop.realize(key), t, last, dt)


_MAX_STEPS = 2**20
_FIRST_STEP = 1e-4  # s; the integrator adapts it


@eqx.filter_jit
def solve(loop, key, start, times, until, jumps, rtol, atol) -> Outcome:
    """Integrate from `start` to `until` (s) with records at `times` (s); arguments as in `continuous.simulate`."""
    import diffrax  # half a second, which no other run needs to wait for

    realization = loop.realize(key)
    # One flat vector, so that the integrator's arithmetic is compiled once, not once per leaf of the state.
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
    last = jnp.maximum(jnp.isfinite(states).all(axis=1).sum() - 1, 0)  # unsaved records are infinite
    index = jnp.minimum(jnp.arange(times.shape[0]), last)
    samples = jax.lax.map(lambda at: realization.record(at[0], *unravel(at[1])), (times[index], states[index]))
    valid = jnp.where(status == int(Status.OK), final[0], states[last])
    ending = blamed(
        running()._replace(status=status, time=ended[0]), realization, ended[0], unravel(final[0]), _FIRST_STEP
    )
    return Outcome(times, samples, (), unravel(valid), *ending)
