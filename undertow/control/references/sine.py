"""A sinusoid on every output, the usual reference of textbook plants."""

import jax.numpy as jnp
import numpy as np
from jaxtyping import Float

from undertow.core import checks
from undertow.core.contracts import AbstractReference, Target
from undertow.core.errors import BadInput
from undertow.core.param import Param, param


class Sine(AbstractReference):
    """offset + amplitude sin(frequency t + phase) on each of n outputs.

    Raises:
        BadInput: not finite, or numbers of entries that do not match.
    """

    amplitude: Float[Param, " n"] = param("m, rad", "amplitude")
    frequency: Float[Param, " n"] = param("rad/s", "angular frequency")
    offset: Float[Param, " n"] = param("m, rad", "middle")
    phase: Float[Param, " n"] = param("rad", "phase at t = 0")

    def __init__(self, amplitude, frequency, offset, phase):
        parameters = {"amplitude": amplitude, "frequency": frequency, "offset": offset, "phase": phase}
        axes = max(np.size(value) for value in parameters.values())
        for name, value in parameters.items():
            if np.shape(value) not in ((), (1,), (axes,)):
                raise BadInput(name, f"be one number, or {axes} of them, one per output", f"of shape {np.shape(value)}")
            checks.finite(name, value)
            setattr(self, name, jnp.broadcast_to(jnp.asarray(value, dtype=float), (axes,)))

    def at(self, t) -> Target:
        angle = self.frequency * t + self.phase
        swing = self.amplitude * jnp.sin(angle)
        rate = self.amplitude * self.frequency * jnp.cos(angle)
        return Target(self.offset + swing, rate, -(self.frequency**2) * swing)


def sine(amplitude=0.1, frequency=1.0, offset=0.0, phase=0.0) -> Sine:
    """Every output oscillates about its middle; the longest argument sets the number of outputs.

    Args:
        amplitude: one number or one per output, m and rad.
        frequency: likewise, rad/s.
        offset: middle of the oscillation, likewise, m and rad.
        phase: at t = 0, likewise, rad.
    """
    return Sine(amplitude, frequency, offset, phase)
