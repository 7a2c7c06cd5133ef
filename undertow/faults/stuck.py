"""A signal that keeps the value of its onset."""

import jax.numpy as jnp

from undertow.faults.mode import NO_SEVERITY, READINGS, AbstractMode, Altered


class Stuck(AbstractMode):
    """The value of the onset, bit for bit; a sensor goes on to deliver it."""

    targets = (*READINGS, "thruster")
    severity = NO_SEVERITY
    delays = False

    def init(self, value):
        return value

    def apply(self, memory, moment, value):
        held = jnp.where(moment.active, memory, value)
        return Altered(held, jnp.asarray(True)), held


def stuck() -> Stuck:
    """Frozen at the last value before the onset."""
    return Stuck()
