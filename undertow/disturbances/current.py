"""A constant, uniform current."""

import jax.numpy as jnp
from jaxtyping import Float

from undertow.core import checks
from undertow.core.contracts import AbstractDisturbance, Load
from undertow.core.param import Param, param
from undertow.disturbances.adding import with_water


class Current(AbstractDisturbance):
    """Water of constant, uniform velocity."""

    velocity: Float[Param, "3"] = param("m/s", "velocity of the water: north, east, down", symbol="v_c")

    def __check_init__(self):
        checks.length("velocity", self.velocity, 3, "north, east, down")
        checks.finite("velocity", self.velocity, "m/s")

    def realize(self, key) -> tuple[()]:
        return ()

    def at(self, realization, t, pose, load: Load) -> Load:
        return with_water(load, pose, self.velocity, jnp.zeros(3))

    def jumps(self, duration: float) -> tuple[float, ...]:
        return ()


def current(velocity=(0.5, 0.0, 0.0)) -> Current:
    """Constant current; drag depends on the velocity relative to the water. Fossen (2021), ch. 10.3.

    Args:
        velocity: of the water over ground, m/s: north, east, down.
    """
    return Current(velocity)
