"""A group of waves."""

import jax.numpy as jnp
from jaxtyping import Float

from undertow.core import checks
from undertow.core.param import Param, param
from undertow.disturbances.adding import with_water
from undertow.faults.mode import AbstractPlantFault, Severity


class WaveBurst(AbstractPlantFault):
    """Sinusoidal motion of uniform water, which begins and ends with it."""

    direction: Float[Param, "3"] = param("", "of the motion, world axes")
    period: Float[Param, ""] = param("s", "of the waves")
    targets = ("plant",)
    severity = Severity("amplitude of the velocity of the water", "m/s", 0.5, 0.0, 10.0)
    default_duration = 10.0

    def __check_init__(self):
        checks.length("direction", self.direction, 3, "north, east, down")
        checks.finite("direction", self.direction)
        checks.positive("period", self.period, "s")

    def load(self, presence, pose, load):
        rate = 2 * jnp.pi / self.period
        speed, rise = jnp.sin(rate * presence.since), rate * jnp.cos(rate * presence.since)
        along = presence.size * self.direction
        return with_water(load, pose, speed * along, rise * along)


def wave_burst(direction=(1.0, 0.0, 0.0), period: float = 5.0) -> WaveBurst:
    """A group of waves, such as the wash of a ship.

    Args:
        direction: of length 1: north, east, down.
        period: of the waves, s.
    """
    return WaveBurst(direction, period)
