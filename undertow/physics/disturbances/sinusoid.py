"""A constant plus a sinusoid on every axis, to test frequency and amplitude."""

import jax.numpy as jnp
from jaxtyping import Float

from undertow.core.contracts import Load
from undertow.core.param import Param, param
from undertow.physics.disturbances.loads import AbstractSmoothDisturbance


class Sinusoid(AbstractSmoothDisturbance):
    """offset + amplitude sin(frequency t + phase), the same arguments for all axes or one per axis."""

    amplitude: Float[Param, "..."] = param("m/s^2, rad/s^2", "amplitude")
    frequency: Float[Param, "..."] = param("rad/s", "angular frequency")
    offset: Float[Param, "..."] = param("m/s^2, rad/s^2", "constant part")
    phase: Float[Param, "..."] = param("rad", "phase at t = 0")

    def at(self, realization, t, pose, load: Load) -> Load:
        signal = self.offset + self.amplitude * jnp.sin(self.frequency * t + self.phase)
        return load._replace(acceleration=load.acceleration + signal)


def sinusoid(amplitude=1.0, frequency=1.0, offset=0.0, phase=0.0) -> Sinusoid:
    """Lumped acceleration offset + amplitude sin(frequency t + phase).

    Args:
        amplitude: m/s^2 and rad/s^2; one number or one per axis.
        frequency: rad/s; likewise.
        offset: m/s^2 and rad/s^2; likewise.
        phase: rad; likewise.
    """
    return Sinusoid(amplitude, frequency, offset, phase)
