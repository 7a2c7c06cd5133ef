"""A straight line at constant speed, with a smooth start and stop."""

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Float

from undertow.core import checks
from undertow.core.contracts import AbstractReference, Target
from undertow.core.errors import BadInput
from undertow.core.numerics.motion_laws import rounded_ramp, with_rates
from undertow.core.param import Param, param

_AXES = "north, east, down"


class Line(AbstractReference):
    """From `start` to `goal`, C2, at rest before and after; level, yaw zero or along the line.

    Raises:
        BadInput: speed or ramp not positive, points that are not three finite entries, equal points, or an undefined
            heading because the line is vertical.
    """

    goal: Float[Param, "3"] = param("m", f"where it ends: {_AXES}")
    speed: Float[Param, ""] = param("m/s", "speed between start and stop")
    start: Float[Param, "3"] = param("m", f"where it starts: {_AXES}")
    ramp: Float[Param, ""] = param("s", "time to reach the speed, and to stop")
    heading: str = eqx.field(static=True, default="fixed")

    def __check_init__(self):
        for name in ("goal", "start"):
            checks.length(name, getattr(self, name), 3, _AXES)
            checks.finite(name, getattr(self, name), "m")
        checks.positive("speed", self.speed, "m/s")
        checks.positive("ramp", self.ramp, "s")
        checks.choice("heading", self.heading, ("fixed", "along"))
        way = self.goal - self.start
        if not checks.assumed(lambda way: (way != 0).any(), way):
            raise BadInput("goal", "differ from `start`", "the same")
        if self.heading == "along" and not checks.assumed(lambda way: (way[:2] != 0).any(), way):
            raise BadInput("heading", "be fixed when the line is vertical", "along")

    def at(self, t) -> Target:
        way = self.goal - self.start
        distance = jnp.sqrt((way**2).sum())
        covered, speed, second = with_rates(lambda t: rounded_ramp(t, distance, self.speed, self.ramp), t)
        yaw = jnp.arctan2(way[1], way[0]) if self.heading == "along" else jnp.zeros(())
        direction = jnp.concatenate([way / distance, jnp.zeros(3)])
        start = jnp.concatenate([self.start, jnp.zeros(2), yaw[None]])
        return Target(start + covered * direction, speed * direction, second * direction)


def line(
    goal=(5.0, 0.0, 0.0), speed: float = 0.5, start=(0.0, 0.0, 0.0), ramp: float = 4.0, heading: str = "fixed"
) -> Line:
    """Straight line at constant speed, smooth start and stop, level, for a vehicle; takes distance / speed + ramp.

    Args:
        goal: north, east, down, m.
        speed: between start and stop, m/s; not reached where distance / speed is below `ramp`.
        start: north, east, down at t = 0, m.
        ramp: time to reach the speed and time to stop, s. The largest acceleration is 1.5 speed / ramp.
        heading: yaw, `fixed` at zero, or `along` the line.
    """
    return Line(goal, speed, start, ramp, heading)
