"""Plant and law as one ordinary differential equation."""

from typing import cast

import jax
from jaxtyping import Array, Float, PyTree

from undertow.core.continuous import AbstractContinuousController
from undertow.loop.closed_loop import Drawn


@jax.jit  # traced once, although an integrator calls it in several places
def flow(t: Float[Array, ""], state: tuple[PyTree, PyTree], drawn: Drawn) -> tuple[PyTree, PyTree]:
    """Rates of plant state x and controller state z at time t."""
    x, z = state
    controller = cast(AbstractContinuousController, drawn.loop.controller)
    decision = drawn.decide(t, x, z)
    x_rate = drawn.loop.plant.dynamics(t, x, decision.applied, drawn.load(t, x))
    return x_rate, controller.flow(z, decision.y, decision.r, decision.applied)
