"""Inertia that the model does not know."""

from jaxtyping import Float

from undertow.core import checks
from undertow.core.contracts import Payload
from undertow.core.param import Param, param
from undertow.disturbances.adding import with_payload
from undertow.faults.mode import AbstractPlantFault, Severity


class Mass(AbstractPlantFault):
    """A point mass that weighs nothing in water, such as water that is carried along."""

    point: Float[Param, "3"] = param("m", "where it is, body axes")
    targets = ("plant",)
    severity = Severity("mass", "kg", 5.0, 0.0, 1e6)
    default_duration = float("inf")

    def __check_init__(self):
        checks.length("point", self.point, 3, "forward, starboard, down")
        checks.finite("point", self.point, "m")

    def load(self, presence, pose, load):
        return with_payload(load, pose, Payload(presence.size, 0.0 * presence.size, self.point))


def mass(point=(0.1, 0.0, 0.0)) -> Mass:
    """Additional mass without weight in water, such as water that is carried along.

    Args:
        point: where it is, m: forward, starboard, down.
    """
    return Mass(point)
