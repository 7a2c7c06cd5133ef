"""A moment."""

import jax.numpy as jnp
from jaxtyping import Float

from undertow.core import checks
from undertow.core.param import Param, param
from undertow.disturbances.adding import body_of
from undertow.faults.mode import AbstractPlantFault, Severity


class Twist(AbstractPlantFault):
    """A constant moment in body axes."""

    direction: Float[Param, "3"] = param("", "of the moment, body axes")
    targets = ("plant",)
    severity = Severity("moment", "N m", 10.0, -1e6, 1e6)
    default_duration = 1.0

    def __check_init__(self):
        checks.length("direction", self.direction, 3, "roll, pitch, yaw")
        checks.finite("direction", self.direction)

    def load(self, presence, pose, load):
        body_of(pose)
        moment = jnp.concatenate([jnp.zeros(3), presence.size * self.direction])
        return load._replace(wrench=load.wrench - moment)


def twist(direction=(0.0, 0.0, 1.0)) -> Twist:
    """A moment for a second, unless a duration is given.

    Args:
        direction: of length 1: roll, pitch, yaw in body axes.
    """
    return Twist(direction)
