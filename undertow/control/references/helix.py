"""A helix about a vertical axis: a circle with growing depth."""

import jax.numpy as jnp
from jaxtyping import Float

from undertow.control.references.circle import Circle
from undertow.core import checks
from undertow.core.contracts import AbstractReference, Target
from undertow.core.param import Param, param


class Helix(AbstractReference):
    """A circle whose depth grows by `sink_rate` t.

    Raises:
        BadInput: radius or period not positive, sink rate or depth not finite, or unknown heading.
    """

    circle: Circle
    sink_rate: Float[Param, ""] = param("m/s", "downward velocity")

    def __check_init__(self):
        checks.finite("sink_rate", self.sink_rate, "m/s")

    def at(self, t) -> Target:
        level = self.circle.at(t)
        sinking = jnp.zeros(6).at[2].set(self.sink_rate)
        return Target(level.position + t * sinking, level.velocity + sinking, level.acceleration)


def helix(
    radius: float = 2.0, period: float = 40.0, sink_rate: float = 0.05, depth: float = 0.0, heading: str = "fixed"
) -> Helix:
    """Helix about a vertical axis, starting at the origin, level, for a vehicle.

    Args:
        radius: m.
        period: time of one turn, s.
        sink_rate: m/s, downward; negative rises.
        depth: at t = 0, m below the origin.
        heading: yaw, `fixed` at zero, or `along` the path (it grows by 2 pi every turn).
    """
    return Helix(Circle(radius, period, depth, heading), sink_rate)
