"""A circle in the horizontal plane."""

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Float

from undertow.core import checks
from undertow.core.contracts import AbstractReference, Target
from undertow.core.param import Param, param


class Circle(AbstractReference):
    """north = R sin(w t), east = R (1 - cos(w t)); depth fixed, level, yaw zero or along the path.

    Raises:
        BadInput: radius or period not positive, or unknown heading.
    """

    radius: Float[Param, ""] = param("m", "radius")
    period: Float[Param, ""] = param("s", "time of one turn")
    depth: Float[Param, ""] = param("m", "depth below the origin")
    heading: str = eqx.field(static=True, default="fixed")

    def __check_init__(self):
        checks.positive("radius", self.radius, "m")
        checks.positive("period", self.period, "s")
        checks.finite("depth", self.depth, "m")
        checks.choice("heading", self.heading, ("fixed", "along"))

    def at(self, t) -> Target:
        rate = 2 * jnp.pi / self.period
        sine, cosine = self.radius * jnp.sin(rate * t), self.radius * jnp.cos(rate * t)
        zero = jnp.zeros(())
        turn = rate if self.heading == "along" else zero
        return Target(
            position=jnp.stack([sine, self.radius - cosine, self.depth, zero, zero, turn * t]),
            velocity=jnp.stack([rate * cosine, rate * sine, zero, zero, zero, turn]),
            acceleration=jnp.stack([-(rate**2) * sine, rate**2 * cosine, zero, zero, zero, zero]),
        )


def circle(radius: float = 2.0, period: float = 40.0, depth: float = 0.0, heading: str = "fixed") -> Circle:
    """Horizontal circle through the origin, level, for a vehicle.

    Args:
        radius: m.
        period: time of one turn, s.
        depth: m below the origin.
        heading: yaw, `fixed` at zero, or `along` the path (it grows by 2 pi every turn).
    """
    return Circle(radius, period, depth, heading)
