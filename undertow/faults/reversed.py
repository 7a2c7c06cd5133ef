"""A thruster that turns the wrong way."""

import jax.numpy as jnp

from undertow.faults.mode import NO_SEVERITY, AbstractMode, Altered


class Reversed(AbstractMode):
    """The sign of the input is wrong."""

    targets = ("thruster",)
    severity = NO_SEVERITY
    delays = False

    def init(self, value):
        return ()

    def apply(self, memory, moment, value):
        return Altered(-value, jnp.asarray(True)), memory


def reversed() -> Reversed:
    """The input acts with the other sign, as after two phases of a motor were exchanged."""
    return Reversed()
