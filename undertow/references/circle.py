"""A circle in the horizontal plane: the simplest moving reference."""

import jax.numpy as jnp
from jaxtyping import Array, Float

from undertow.core import checks
from undertow.core.contracts import AbstractReference, Target
from undertow.core.param import param


class Circle(AbstractReference):
    """north = R sin(w t), east = R (1 - cos(w t)); depth and attitude fixed.

    Raises:
        BadInput: radius or period not positive.
    """

    radius: Float[Array, ""] = param("m", "radius")
    period: Float[Array, ""] = param("s", "time of one turn")
    depth: Float[Array, ""] = param("m", "depth below the origin")

    def __check_init__(self):
        checks.positive("radius", self.radius, "m")
        checks.positive("period", self.period, "s")
        checks.finite("depth", self.depth, "m")

    def at(self, t) -> Target:
        rate = 2 * jnp.pi / self.period
        sine, cosine = self.radius * jnp.sin(rate * t), self.radius * jnp.cos(rate * t)
        rest = jnp.zeros(4)
        return Target(
            position=jnp.concatenate([jnp.stack([sine, self.radius - cosine, self.depth]), jnp.zeros(3)]),
            velocity=jnp.concatenate([jnp.stack([rate * cosine, rate * sine]), rest]),
            acceleration=jnp.concatenate([jnp.stack([-(rate**2) * sine, rate**2 * cosine]), rest]),
        )


def circle(radius: float = 2.0, period: float = 40.0, depth: float = 0.0) -> Circle:
    """Horizontal circle through the origin, level attitude, for a vehicle.

    Args:
        radius: m.
        period: time of one turn, s.
        depth: m below the origin.
    """
    return Circle(radius, period, depth)
