"""Water that enters the hull."""

import jax.numpy as jnp
from jaxtyping import Float

from undertow.core import checks
from undertow.core.contracts import Payload
from undertow.core.param import Param, param
from undertow.disturbances.adding import with_payload
from undertow.faults.mode import AbstractPlantFault, Severity

_GRAVITY = 9.81  # m/s^2


class Leak(AbstractPlantFault):
    """Water that collects at a point of the hull, at a constant rate until all of it has entered."""

    point: Float[Param, "3"] = param("m", "where the water collects, body axes")
    rise: Float[Param, ""] = param("s", "time in which it enters")
    targets = ("plant",)
    severity = Severity("mass of the water in the end", "kg", 1.0, 0.0, 1e6)
    default_duration = float("inf")

    def __check_init__(self):
        checks.length("point", self.point, 3, "forward, starboard, down")
        checks.finite("point", self.point, "m")
        checks.positive("rise", self.rise, "s")

    def load(self, presence, pose, load):
        entered = presence.size * jnp.clip(presence.since / self.rise, 0.0, 1.0)
        return with_payload(load, pose, Payload(entered, _GRAVITY * entered, self.point))


def leak(point=(-0.1, 0.0, 0.0), rise: float = 10.0) -> Leak:
    """Leak: water enters the hull, which adds mass and takes buoyancy.

    Args:
        point: where the water collects, m: forward, starboard, down.
        rise: time in which it enters, s.
    """
    return Leak(point, rise)
