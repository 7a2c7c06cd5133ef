"""A constant, uniform current."""

import jax.numpy as jnp
from jaxtyping import Float

from undertow.core import checks
from undertow.core.contracts import Load
from undertow.core.param import Param, param
from undertow.physics.disturbances.loads import AbstractSmoothDisturbance, with_water


class Current(AbstractSmoothDisturbance):
    """Water of constant, uniform velocity."""

    velocity: Float[Param, "3"] = param("m/s", "velocity of the water: north, east, down", symbol="v_c")

    def __check_init__(self):
        checks.length("velocity", self.velocity, 3, "north, east, down")
        checks.finite("velocity", self.velocity, "m/s")

    def at(self, realization, t, pose, load: Load) -> Load:
        return with_water(load, pose, self.velocity, jnp.zeros(3))


def current(velocity=(0.5, 0.0, 0.0)) -> Current:
    """Constant current; drag depends on the velocity relative to the water. Fossen (2021), ch. 10.3.

    Args:
        velocity: of the water over ground, m/s: north, east, down.
    """
    return Current(velocity)
