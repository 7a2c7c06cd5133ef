"""A factor on a signal."""

import jax.numpy as jnp

from undertow.faults.mode import READINGS, AbstractMode, Altered, Severity


class Scale(AbstractMode):
    """A factor on every entry."""

    targets = (*READINGS, "thruster")
    severity = Severity("factor", "", 1.5, -100.0, 100.0)
    delays = False

    def init(self, value):
        return ()

    def apply(self, memory, moment, value):
        return Altered(moment.severity * value, jnp.asarray(True)), memory


def scale() -> Scale:
    """Factor on the signal, such as a wrong calibration, or half of the voltage of a thruster."""
    return Scale()
