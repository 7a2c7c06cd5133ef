"""Noise that is added to a signal."""

import jax
import jax.numpy as jnp

from undertow.faults.mode import INPUTS, LARGE, READINGS, TARGET, AbstractMode, Altered, Severity
from undertow.numerics.random_keys import numbered


class Noise(AbstractMode):
    """Normally distributed noise, independent from one control step to the next."""

    targets = (*READINGS, *INPUTS)
    severity = Severity("standard deviation", TARGET, 0.3, 0.0, LARGE)
    delays = False

    def init(self, value):
        return ()

    def apply(self, memory, moment, value):
        return Altered(
            value + moment.severity * jax.random.normal(numbered(moment.key, moment.step), value.shape, value.dtype),
            jnp.asarray(True),
        ), memory


def noise() -> Noise:
    """White noise on the signal; on the bus a ripple, which differs between the inputs."""
    return Noise()
