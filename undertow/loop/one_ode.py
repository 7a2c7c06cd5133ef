"""Plant and law as one ordinary differential equation."""

from typing import Any, cast

import jax
import jax.numpy as jnp
from jaxtyping import Array, Float, PyTree

from undertow.core.continuous import AbstractContinuousController
from undertow.loop.closed_loop import Realization
from undertow.loop.outcome import Ending
from undertow.loop.readings import all_finite


@jax.jit  # traced once, although an integrator calls it in several places
def flow(t: Float[Array, ""], state: tuple[PyTree, PyTree], realization: Realization) -> tuple[PyTree, PyTree]:
    """Rates of plant state x and controller state z at time t; undefined where a command is."""
    x, z = state
    controller = cast(AbstractContinuousController, realization.loop.controller)
    decision = realization.decide(t, x, z)
    x_rate = realization.loop.plant.dynamics(t, x, decision.applied, realization.load(t, x))
    commanded = jnp.isfinite(decision.command).all()  # limits and dead zones make numbers of what is none
    x_rate = jax.tree.map(lambda rate: jnp.where(commanded, rate, jnp.nan), x_rate)
    return x_rate, controller.flow(z, decision.y, decision.r, decision.applied)


def blamed(
    ending: Ending, realization: Realization, t: Float[Array, ""], state: tuple[PyTree, PyTree], dt: Any
) -> Ending:
    """The ending of a run that got no further than some states at `t` (s), its cause named if it is a command.

    The command is looked at where Runge and Kutta's method did during the step of dt (s) that failed: at its start, in
    the middle, at the end.
    """
    rate = flow(t, state, realization)
    for share in (0.0, 0.5, 1.0):
        there = t + share * dt
        ahead = jax.tree.map(lambda now, change, share=share: now + share * dt * change, state, rate)
        at = ahead if share else state
        blame = ending.blamed(realization.decide(there, *at).command, there)
        # Of a state that is itself no number, which a load can make, every command is none.
        ending = Ending(*(jnp.where(all_finite(at), new, old) for new, old in zip(blame, ending, strict=True)))
    return ending
