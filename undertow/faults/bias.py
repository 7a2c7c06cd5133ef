"""A constant that is added to a signal."""

import jax.numpy as jnp

from undertow.faults.mode import LARGE, READINGS, TARGET, AbstractMode, Altered, Severity


class Bias(AbstractMode):
    """An offset of every entry."""

    targets = (*READINGS, "thruster")
    severity = Severity("offset", TARGET, 1.0, -LARGE, LARGE)
    delays = False

    def init(self, value):
        return ()

    def apply(self, memory, moment, value):
        return Altered(value + moment.severity, jnp.asarray(True)), memory


def bias() -> Bias:
    """Offset of the signal."""
    return Bias()
