"""A push."""

from jaxtyping import Float

from undertow.core import checks
from undertow.core.param import Param, param
from undertow.disturbances.adding import with_force
from undertow.faults.mode import AbstractPlantFault, Severity


class Shove(AbstractPlantFault):
    """A constant force in world axes at a point of the body."""

    direction: Float[Param, "3"] = param("", "of the force, world axes")
    point: Float[Param, "3"] = param("m", "where it acts, body axes")
    targets = ("plant",)
    severity = Severity("force", "N", 50.0, -1e6, 1e6)
    default_duration = 1.0

    def __check_init__(self):
        checks.length("direction", self.direction, 3, "north, east, down")
        checks.length("point", self.point, 3, "forward, starboard, down")
        checks.finite("direction", self.direction)
        checks.finite("point", self.point, "m")

    def load(self, presence, pose, load):
        return with_force(load, pose, presence.size * self.direction, self.point)


def shove(direction=(1.0, 0.0, 0.0), point=(0.0, 0.0, 0.0)) -> Shove:
    """A push: a force for a second, unless a duration is given.

    Args:
        direction: of the force, of length 1: north, east, down.
        point: where it acts, m: forward, starboard, down.
    """
    return Shove(direction, point)
