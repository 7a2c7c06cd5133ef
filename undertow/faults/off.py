"""A signal that is zero, or a sensor that delivers nothing."""

import jax.numpy as jnp

from undertow.faults.mode import INPUTS, NO_SEVERITY, READINGS, AbstractMode, Altered


class Off(AbstractMode):
    """Zero; the readings of a sensor do not arrive."""

    targets = (*READINGS, *INPUTS)
    severity = NO_SEVERITY
    delays = False

    def init(self, value):
        return ()

    def apply(self, memory, moment, value):
        return Altered(jnp.zeros_like(value), jnp.asarray(False)), memory


def off() -> Off:
    """Nothing: a quantity reads zero, a sensor delivers no readings, a thruster gets zero, the bus is dead."""
    return Off()
