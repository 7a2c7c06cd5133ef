"""A lawn-mower pattern: parallel legs with half circles between them, as in surveys of the seabed."""

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from undertow.core import checks
from undertow.core.contracts import AbstractReference, Target
from undertow.core.errors import BadInput
from undertow.core.numerics.motion_laws import rounded_ramp, with_rates
from undertow.core.param import Param, param

# The rate of yaw along the path jumps where an arc begins; yaw is rounded over this share of the arc.
_ROUNDING = 0.25


class LawnMower(AbstractReference):
    """Legs north and south, each further east; constant speed, smooth start and stop, at rest before and after.

    Position is C1: the acceleration jumps by 2 speed^2 / spacing where a half circle begins or ends.

    Raises:
        BadInput: length, spacing, speed or ramp not positive, count not a whole number above zero, depth not finite, or
            unknown heading.
    """

    length: Float[Param, ""] = param("m", "length of a leg")
    spacing: Float[Param, ""] = param("m", "distance between legs")
    speed: Float[Param, ""] = param("m/s", "speed between start and stop")
    ramp: Float[Param, ""] = param("s", "time to reach the speed, and to stop")
    depth: Float[Param, ""] = param("m", "depth below the origin")
    count: int = eqx.field(static=True, default=4)
    heading: str = eqx.field(static=True, default="fixed")

    def __check_init__(self):
        for name, unit in {"length": "m", "spacing": "m", "speed": "m/s", "ramp": "s"}.items():
            checks.positive(name, getattr(self, name), unit)
        checks.finite("depth", self.depth, "m")
        checks.choice("heading", self.heading, ("fixed", "along"))
        if not isinstance(self.count, int) or self.count < 1:
            raise BadInput("count", "be a whole number above zero", self.count)

    def at(self, t) -> Target:
        radius = self.spacing / 2
        arc = jnp.pi * radius
        total = self.count * self.length + (self.count - 1) * arc

        def pose(t):
            covered = rounded_ramp(t, total, self.speed, self.ramp)
            legs_done = jnp.clip(jnp.floor(covered / (self.length + arc)), 0.0, self.count - 1.0)
            on_leg = covered - legs_done * (self.length + arc)
            turned = jnp.where(on_leg > self.length, (on_leg - self.length) / radius, 0.0)
            ahead = on_leg - radius * turned + radius * jnp.sin(turned)
            north = jnp.where(legs_done % 2 == 0, ahead, self.length - ahead)
            east = legs_done * self.spacing + radius * (1 - jnp.cos(turned))
            yaw = self._yaw(covered) if self.heading == "along" else jnp.zeros(())
            zero = jnp.zeros(())
            return jnp.stack([north, east, self.depth, zero, zero, yaw])

        return Target(*with_rates(pose, t))

    def _yaw(self, covered: Float[Array, ""]) -> Float[Array, ""]:
        """Yaw, C2 in the distance covered: clockwise in every other half circle, counterclockwise in the rest."""
        arc = jnp.pi * self.spacing / 2
        rounding = _ROUNDING * arc
        turns = np.arange(self.count - 1.0)
        begins = self.length + turns * (self.length + arc) - rounding / 2
        return (rounded_ramp(covered - begins, jnp.pi, jnp.pi / arc, rounding) * (-1.0) ** turns).sum()


def lawn_mower(
    length: float = 10.0,
    spacing: float = 2.0,
    count: int = 4,
    speed: float = 0.5,
    ramp: float = 4.0,
    depth: float = 0.0,
    heading: str = "fixed",
) -> LawnMower:
    """Parallel legs with half circles between them, from the origin north and east, level, for a vehicle.

    Args:
        length: of a leg, m.
        spacing: between legs, m; the half circles have half of it as radius.
        count: number of legs.
        speed: between start and stop, m/s.
        ramp: time to reach the speed and time to stop, s. The duration is path length / speed + ramp.
        depth: m below the origin.
        heading: yaw, `fixed` at zero, or `along` the path (within 5 degrees where a half circle begins or ends, so
            that its rate does not jump).
    """
    return LawnMower(length, spacing, speed, ramp, depth, count, heading)
