"""The sampled loop: controller steps with the plant integrated between them, compiled as one scan."""

import abc
from collections.abc import Callable
from functools import partial
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Float, PRNGKeyArray, PyTree

from undertow.core.contracts import Outputs
from undertow.core.errors import BadInput
from undertow.core.numerics.integrators import METHODS, first_stage
from undertow.core.return_checks import check_state
from undertow.simulation.loop.closed_loop import ClosedLoop, Realization
from undertow.simulation.loop.outcome import Outcome, running
from undertow.simulation.loop.recorded_signals import Signals
from undertow.simulation.loop.recording import freeze_on_failure, instant, record


class AbstractAccumulator(eqx.Module):
    """Statistics accumulated inside the loop, so that a long run need not keep its series."""

    @abc.abstractmethod
    def init(self, signals: Signals) -> PyTree:
        """State before the first sample; `signals` gives the shapes."""

    @abc.abstractmethod
    def update(self, state: PyTree, t: Float[Array, ""], signals: Signals) -> PyTree:
        """State with one more sample."""


def simulate(
    loop: ClosedLoop,
    *,
    duration: float,
    dt: float = 1e-3,
    key: PRNGKeyArray | None = None,
    position: Any = None,
    velocity: Any = None,
    record_every: int = 10,
    accumulators: tuple[AbstractAccumulator, ...] = (),
    method: str = "rk4",
    substeps: int = 1,
) -> Outcome:
    """Run a closed loop with the input held over each sampling time.

    Args:
        loop: closed loop.
        duration: s; rounded to whole steps.
        dt: sampling time of the controller, s.
        key: for everything random; None for key 0.
        position, velocity: outputs at t = 0; None for zero.
        record_every: steps per record; 0 keeps only accumulated statistics, no series.
        accumulators: statistics over every control step.
        method, substeps: integration of the plant within one control step, rk4 or euler.

    Returns:
        Outcome. A failed run keeps its last valid state; nothing is raised.

    Raises:
        BadInput: duration or dt not positive, or duration shorter than one record.
    """
    steps, loop = steps_of(duration, dt, record_every), loop.starting_at(position)
    key = jax.random.PRNGKey(0) if key is None else key
    start = loop.outputs_at_start(position, velocity)
    plan = (steps, record_every, method, substeps)
    return _run(loop, key, start, jnp.asarray(dt, dtype=float), accumulators, plan)


def steps_of(duration: float, dt: float, record_every: int) -> int:
    """Number of control steps of a run; for arguments and errors see `simulate`."""
    if not (0 < dt < float("inf")):
        raise BadInput("dt", "be positive", f"{dt:g} s")
    steps = round(duration / dt) if 0 < duration < float("inf") else 0
    if steps < max(1, record_every):
        raise BadInput("duration", f"be at least one record ({max(1, record_every) * dt:g} s)", f"{duration:g} s")
    return steps


@eqx.filter_jit
def _run(loop, key, start, dt, accumulators, plan: tuple[int, int, str, int]) -> Outcome:
    steps, record_every, method, substeps = plan
    realization = loop.realize(key)
    carry = begin(realization, start, accumulators)
    advance = partial(control_step, realization, accumulators, dt, METHODS[method], substeps)
    if record_every == 0:
        carry = jax.lax.fori_loop(0, steps, lambda k, c: advance(c, k), carry)
        blank = jax.eval_shape(realization.record, dt, *carry[0])
        time, samples = jnp.zeros(0), jax.tree.map(lambda leaf: jnp.zeros((0, *leaf.shape)), blank)
    else:
        carry, (time, samples) = record(realization, advance, carry, dt, steps, record_every)
    final, gathered, ending = carry
    return Outcome(time, samples, gathered, final[:2], *ending.until(steps * dt))


def integrate_plant(motion: Callable, t, x: PyTree, dt, integrate: Callable, substeps: int) -> PyTree:
    """State of the plant one control step after t, with the input held.

    Args:
        motion: (t, x) -> dx/dt under that input.
        t: s.
        x: state at t.
        dt: sampling time, s.
        integrate: step of a method of `numerics.integrators`.
        substeps: how many of them.
    """
    h = dt / substeps
    if substeps == 1:
        return integrate(motion, t, x, h)
    return jax.lax.fori_loop(0, substeps, lambda i, x: integrate(motion, t + instant(i, h), x, h), x)


def begin(realization: Realization, start: tuple[Outputs, Outputs], accumulators) -> PyTree:
    """Carry before the first control step."""
    x, z = realization.start(*start)
    states = (x, z, realization.initial_measuring(x))
    blank = jax.tree.map(jnp.zeros_like, jax.eval_shape(realization.record, jnp.zeros(()), *states))
    gathered = tuple(a.init(blank) for a in accumulators)
    return (states, gathered, running())


def control_step(realization: Realization, accumulators, dt, integrate, substeps: int, carry, k):
    """Command, integrate the plant with the input held, then advance the controller with the applied input."""
    (x, z, measuring), gathered, ending = carry
    loop, t = realization.loop, instant(k, dt)
    decision = realization.decide(t, x, z, measuring)
    if accumulators:
        # Of the first stage, whose acceleration is then computed once; where the load jumps, it has jumped.
        signals = realization.signals(jnp.asarray(first_stage(t, dt / substeps)), x, z, decision)
        gathered = tuple(a.update(g, t, signals) for a, g in zip(accumulators, gathered, strict=True))
    new_x = integrate_plant(lambda t, x: realization.motion(t, x, decision.acting), t, x, dt, integrate, substeps)
    y, law = decision.y, loop.controller
    new_z = law.advance(z, y, decision.r, decision.applied, dt)
    check_state(law, new_z, z)
    remembered = decision.measuring
    if remembered.expected is not None and not law.takes_raw_readings:
        expected = remembered.expected.after(law, z, y, decision.signals.get("estimate"), decision.applied, dt)
        remembered = remembered._replace(expected=expected)
    new = (new_x, new_z, remembered)
    state, ending = freeze_on_failure(loop, (x, z, measuring), new, ending, t, dt, decision.command)
    return state, gathered, ending
