"""A current that sets in."""

import jax.numpy as jnp
from jaxtyping import Float

from undertow.core import checks
from undertow.core.param import Param, param
from undertow.disturbances.adding import with_water
from undertow.faults.mode import AbstractPlantFault, Severity


class CurrentStep(AbstractPlantFault):
    """Uniform water of constant velocity from the onset on; the water does not accelerate gradually."""

    direction: Float[Param, "3"] = param("", "of the current, world axes")
    targets = ("plant",)
    severity = Severity("speed of the water", "m/s", 0.5, -10.0, 10.0)
    default_duration = float("inf")

    def __check_init__(self):
        checks.length("direction", self.direction, 3, "north, east, down")
        checks.finite("direction", self.direction)

    def load(self, presence, pose, load):
        return with_water(load, pose, presence.size * self.direction, jnp.zeros(3))


def current_step(direction=(1.0, 0.0, 0.0)) -> CurrentStep:
    """A current that sets in at once.

    Args:
        direction: of length 1: north, east, down.
    """
    return CurrentStep(direction)
