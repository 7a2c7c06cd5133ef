"""A tether that is caught."""

import jax.numpy as jnp
from jaxtyping import Float

from undertow.core import checks
from undertow.core.param import Param, param
from undertow.disturbances.adding import body_of, with_force
from undertow.faults.mode import AbstractPlantFault, Severity
from undertow.numerics.linear_algebra import matvec

_TINY = 1e-9  # m


class TetherSnag(AbstractPlantFault):
    """An elastic cable to a fixed point, slack within its length, which pulls from the onset on."""

    anchor: Float[Param, "3"] = param("m", "where it is caught, world axes")
    point: Float[Param, "3"] = param("m", "attachment on the vehicle, body axes")
    length: Float[Param, ""] = param("m", "length that is free")
    targets = ("plant",)
    severity = Severity("tension per extension", "N/m", 100.0, 0.0, 1e6)
    default_duration = float("inf")

    def __check_init__(self):
        checks.length("anchor", self.anchor, 3, "north, east, down")
        checks.length("point", self.point, 3, "forward, starboard, down")
        for name in ("anchor", "point"):
            checks.finite(name, getattr(self, name), "m")
        checks.not_negative("length", self.length, "m")

    def load(self, presence, pose, load):
        body = body_of(pose)
        span = self.anchor - body.position - matvec(body.rotation, self.point)
        distance = jnp.sqrt((span**2).sum() + _TINY**2)
        tension = presence.size * jnp.maximum(distance - self.length, 0.0)
        return with_force(load, pose, tension * span / distance, self.point)


def tether_snag(anchor=(-2.0, 0.0, 0.0), point=(0.0, 0.0, 0.0), length: float = 1.5) -> TetherSnag:
    """A tether that is caught at a fixed point.

    Args:
        anchor: where it is caught, m: north, east, down.
        point: attachment on the vehicle, m: forward, starboard, down.
        length: of the free part, m.
    """
    return TetherSnag(anchor, point, length)
