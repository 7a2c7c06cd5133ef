"""A thruster at an input that nobody asks for."""

import jax.numpy as jnp

from undertow.faults.mode import AbstractMode, Altered, Severity


class Runaway(AbstractMode):
    """A constant input, whatever is commanded."""

    targets = ("thruster",)
    severity = Severity("input as a share of the largest, negative for reverse", "", 1.0, -1.0, 1.0)
    delays = False

    def init(self, value):
        return ()

    def apply(self, memory, moment, value):
        return Altered(jnp.full_like(value, 1.0) * moment.severity, jnp.asarray(True)), memory


def runaway() -> Runaway:
    """Full thrust, or another constant one, whatever is commanded."""
    return Runaway()
