"""A fixed goal."""

import jax.numpy as jnp
from jaxtyping import Array, Float

from undertow.core import checks
from undertow.core.contracts import AbstractReference, Target
from undertow.core.param import param


class Setpoint(AbstractReference):
    """The same position for ever, at rest.

    Raises:
        BadInput: not finite.
    """

    position: Float[Array, " n"] = param("m, rad", "wanted position", symbol="x_d")

    def __check_init__(self):
        checks.finite("position", self.position)

    def at(self, t) -> Target:
        zero = jnp.zeros_like(self.position)
        return Target(self.position, zero, zero)


def setpoint(position) -> Setpoint:
    """Go to a position and stay.

    Args:
        position: one entry per output, m and rad.
    """
    return Setpoint(position)
