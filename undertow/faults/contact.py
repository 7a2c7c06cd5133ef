"""A wall, or the bottom."""

import jax.numpy as jnp
from jaxtyping import Float

from undertow.core import checks
from undertow.core.param import Param, param
from undertow.disturbances.adding import body_of, with_force
from undertow.faults.mode import AbstractPlantFault, Severity


class Contact(AbstractPlantFault):
    """A plane that pushes the origin of the vehicle back by a stiff spring and a damper; it neither pulls nor rubs."""

    direction: Float[Param, "3"] = param("", "from free water into the obstacle, world axes")
    stiffness: Float[Param, ""] = param("N/m", "force per depth of penetration")
    damping: Float[Param, ""] = param("N s/m", "force per speed of penetration")
    targets = ("plant",)
    severity = Severity("position of the obstacle along its direction", "m", -0.05, -1e6, 1e6)
    default_duration = float("inf")

    def __check_init__(self):
        checks.length("direction", self.direction, 3, "north, east, down")
        checks.finite("direction", self.direction)
        checks.not_negative("stiffness", self.stiffness, "N/m")
        checks.not_negative("damping", self.damping, "N s/m")

    def load(self, presence, pose, load):
        body = body_of(pose)
        depth = (self.direction * body.position).sum() - presence.severity
        push = self.stiffness * depth + self.damping * (self.direction * body.velocity).sum()
        force = jnp.where(presence.active & (depth > 0), jnp.maximum(push, 0.0), 0.0)
        return with_force(load, pose, -force * self.direction, jnp.zeros(3))


def contact(direction=(1.0, 0.0, 0.0), stiffness: float = 1000.0, damping: float = 200.0) -> Contact:
    """Contact with an obstacle: beyond a plane the vehicle is pushed back.

    Args:
        direction: from free water into the obstacle, of length 1: (0, 0, 1) for the bottom, (1, 0, 0) for a wall ahead.
        stiffness: N per m of penetration.
        damping: N per m/s of penetration.
    """
    return Contact(direction, stiffness, damping)
