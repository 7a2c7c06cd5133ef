"""A supply that has lost voltage."""

import jax.numpy as jnp

from undertow.faults.mode import AbstractMode, Altered, Severity


class Sag(AbstractMode):
    """All inputs are limited to a smaller range."""

    targets = ("bus",)
    severity = Severity("lost share of the largest input", "", 0.4, 0.0, 1.0)
    delays = False

    def init(self, value):
        return ()

    def apply(self, memory, moment, value):
        return Altered(jnp.clip(value, moment.severity - 1, 1 - moment.severity), jnp.asarray(True)), memory


def sag() -> Sag:
    """Inputs of all thrusters are limited to a smaller range, as by a supply that has lost voltage."""
    return Sag()
