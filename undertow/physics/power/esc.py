"""Electronic speed controller: pulses of whole microseconds in, a share of the bus voltage out."""

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Float

from undertow.core import checks
from undertow.core.param import Param, param

Scalar = Float[Array, ""]
PerThruster = Float[Array, " N"] | Float[Array, ""]


class ESC(eqx.Module):
    """Duty = (pulse - neutral) / span, V = duty times bus voltage; no loss, and no output inside the dead band.

    Raises:
        BadInput: neutral, span or resolution not positive, dead band negative.
    """

    neutral: Float[Param, ""] = param("us", "pulse that means stop")
    span: Float[Param, ""] = param("us", "from stop to full voltage in either direction")
    dead_band: Float[Param, ""] = param("us", "distance from neutral up to which the output is zero")
    resolution: Float[Param, ""] = param("us", "step of the pulses")

    def __check_init__(self):
        for name in ("neutral", "span", "resolution"):
            checks.positive(name, getattr(self, name), "us")
        checks.not_negative("dead_band", self.dead_band, "us")

    def pulse(self, voltage: PerThruster, bus: Scalar, limited: Array | bool = False) -> PerThruster:
        """Pulse, us, for a voltage in V: within the span, rounded; towards neutral where the voltage is limited."""
        steps = self.neutral / self.resolution + self.span / self.resolution * jnp.clip(voltage / bus, -1.0, 1.0)
        inward = jnp.where(voltage < 0, jnp.ceil(steps), jnp.floor(steps))
        return self.resolution * jnp.where(limited, inward, jnp.round(steps))

    def voltage(self, pulse: PerThruster, bus: Scalar) -> PerThruster:
        """Voltage, V, that a pulse in us gives."""
        offset = pulse - self.neutral
        duty = jnp.where(jnp.abs(offset) > self.dead_band, offset / self.span, 0.0)
        return jnp.clip(duty, -1.0, 1.0) * bus


def esc(neutral: float = 1500.0, span: float = 400.0, dead_band: float = 25.0, resolution: float = 1.0) -> ESC:
    """Speed controllers with servo pulses. Rounding is discontinuous: use them with the sampled loop.

    Args:
        neutral: pulse that means stop, us.
        span: from stop to full voltage in either direction, us.
        dead_band: distance from neutral up to which the output is zero, us; 24 to 28 in the T200's table at 20 V.
        resolution: step of the pulses, us.
    """
    return ESC(neutral, span, dead_band, resolution)
