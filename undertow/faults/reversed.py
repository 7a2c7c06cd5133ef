"""A thruster that turns the wrong way."""

from typing import ClassVar

import jax.numpy as jnp

from undertow.faults.mode import NO_SEVERITY, AbstractMode, Altered


class Reversed(AbstractMode):
    """The sign of the input is wrong."""

    targets: ClassVar = ("thruster",)
    severity: ClassVar = NO_SEVERITY
    delays: ClassVar = False

    def init(self, value):
        return ()

    def apply(self, memory, moment, value):
        return Altered(-value, jnp.asarray(True)), memory


def reversed() -> Reversed:
    """The input acts with the other sign, as after two phases of a motor were exchanged."""
    return Reversed()
