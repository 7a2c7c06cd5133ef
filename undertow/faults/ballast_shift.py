"""A centre of gravity that has moved."""

import jax.numpy as jnp
from jaxtyping import Float

from undertow.core import checks
from undertow.core.contracts import Payload
from undertow.core.param import Param, param
from undertow.disturbances.adding import with_payload
from undertow.faults.mode import AbstractPlantFault, Severity

_GRAVITY = 9.81  # m/s^2


class BallastShift(AbstractPlantFault):
    """A part of the mass inside the hull is at another place: weight, moments and inertia follow."""

    ballast: Float[Param, ""] = param("kg", "mass that moves")
    point: Float[Param, "3"] = param("m", "where it was, body axes")
    direction: Float[Param, "3"] = param("", "in which it moves, body axes")
    targets = ("plant",)
    severity = Severity("distance", "m", 0.1, -10.0, 10.0)
    default_duration = float("inf")

    def __check_init__(self):
        checks.not_negative("ballast", self.ballast, "kg")
        for name in ("point", "direction"):
            checks.length(name, getattr(self, name), 3, "forward, starboard, down")
            checks.finite(name, getattr(self, name))

    def load(self, presence, pose, load):
        mass = jnp.where(presence.active, self.ballast, 0.0)
        there = Payload(mass, _GRAVITY * mass, self.point + presence.size * self.direction)
        return with_payload(with_payload(load, pose, there), pose, Payload(-mass, -_GRAVITY * mass, self.point))


def ballast_shift(ballast: float = 2.0, point=(0.0, 0.0, 0.0), direction=(1.0, 0.0, 0.0)) -> BallastShift:
    """Shift of the centre of gravity: ballast, or a battery, slides in the hull.

    Args:
        ballast: mass that moves, kg, which is a part of the vehicle.
        point: where it was, m: forward, starboard, down.
        direction: in which it moves, of length 1: forward, starboard, down.
    """
    return BallastShift(ballast, point, direction)
