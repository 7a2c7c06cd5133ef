"""Random numbers in place of a signal."""

import jax
import jax.numpy as jnp

from undertow.faults.mode import LARGE, READINGS, TARGET, AbstractMode, Altered, Severity
from undertow.numerics.random_keys import numbered


class Garbage(AbstractMode):
    """Normally distributed random numbers, new at every control step, whatever the signal is."""

    targets = (*READINGS, "thruster")
    severity = Severity("standard deviation", TARGET, 2.0, 0.0, LARGE)
    delays = False

    def init(self, value):
        return ()

    def apply(self, memory, moment, value):
        return Altered(
            moment.severity * jax.random.normal(numbered(moment.key, moment.step), value.shape, value.dtype),
            jnp.asarray(True),
        ), memory


def garbage() -> Garbage:
    """Random numbers in place of the signal."""
    return Garbage()
