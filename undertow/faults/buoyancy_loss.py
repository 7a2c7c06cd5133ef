"""Buoyancy that is lost at once."""

from jaxtyping import Float

from undertow.core import checks
from undertow.core.contracts import Payload
from undertow.core.param import Param, param
from undertow.disturbances.adding import with_payload
from undertow.faults.mode import AbstractPlantFault, Severity


class BuoyancyLoss(AbstractPlantFault):
    """A weight without mass."""

    point: Float[Param, "3"] = param("m", "where the buoyancy is lost, body axes")
    targets = ("plant",)
    severity = Severity("lost buoyancy; negative for lost ballast", "N", 10.0, -1e6, 1e6)
    default_duration = float("inf")

    def __check_init__(self):
        checks.length("point", self.point, 3, "forward, starboard, down")
        checks.finite("point", self.point, "m")

    def load(self, presence, pose, load):
        return with_payload(load, pose, Payload(0.0 * presence.size, presence.size, self.point))


def buoyancy_loss(point=(0.1, 0.0, 0.0)) -> BuoyancyLoss:
    """Loss of buoyancy, such as a block of foam that has gone; a negative severity is ballast that was dropped.

    Args:
        point: where the buoyancy is lost, m: forward, starboard, down.
    """
    return BuoyancyLoss(point)
