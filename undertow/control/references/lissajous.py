"""A Lissajous figure: a sinusoid of its own on every axis, so that all axes are excited."""

import jax.numpy as jnp
from jaxtyping import Float

from undertow.core import checks
from undertow.core.contracts import AbstractReference, Target
from undertow.core.param import Param, param

_AXES = "north, east, down, yaw"


class Lissajous(AbstractReference):
    """amplitude sin(frequency t + phase) in north, east, down and yaw; level.

    Raises:
        BadInput: not four entries, or not finite.
    """

    amplitude: Float[Param, "4"] = param("m, rad", f"amplitude of {_AXES}")
    frequency: Float[Param, "4"] = param("rad/s", f"angular frequency of {_AXES}")
    phase: Float[Param, "4"] = param("rad", f"phase at t = 0 of {_AXES}")
    depth: Float[Param, ""] = param("m", "depth of the centre below the origin")

    def __check_init__(self):
        for name in ("amplitude", "frequency", "phase"):
            checks.length(name, getattr(self, name), 4, _AXES)
            checks.finite(name, getattr(self, name))
        checks.finite("depth", self.depth, "m")

    def at(self, t) -> Target:
        angle = self.frequency * t + self.phase
        wave = self.amplitude * jnp.sin(angle)
        rate = self.amplitude * self.frequency * jnp.cos(angle)
        level = lambda four: jnp.concatenate([four[:3], jnp.zeros(2), four[3:]])
        return Target(level(wave).at[2].add(self.depth), level(rate), level(-(self.frequency**2) * wave))


def lissajous(
    amplitude=(2.0, 1.0, 0.0, 0.0), frequency=(0.1, 0.2, 0.1, 0.1), phase=(0.0, 0.0, 0.0, 0.0), depth: float = 0.0
) -> Lissajous:
    """Lissajous figure about the origin, level, for a vehicle; by default a horizontal figure of eight.

    Args:
        amplitude: of north, east, down (m) and yaw (rad).
        frequency: of the same four, rad/s.
        phase: of the same four at t = 0, rad.
        depth: of the centre, m below the origin.
    """
    return Lissajous(amplitude, frequency, phase, depth)
