"""A thruster that does not start at small inputs."""

import jax.numpy as jnp

from undertow.faults.mode import AbstractMode, Altered, Severity


class DeadZone(AbstractMode):
    """Inputs below a threshold have no effect."""

    targets = ("thruster",)
    severity = Severity("threshold as a share of the largest input", "", 0.3, 0.0, 1.0)
    delays = False

    def init(self, value):
        return ()

    def apply(self, memory, moment, value):
        return Altered(
            jnp.where(jnp.abs(value) < moment.severity, jnp.zeros_like(value), value), jnp.asarray(True)
        ), memory


def dead_zone() -> DeadZone:
    """Inputs smaller than the severity have no effect."""
    return DeadZone()
