"""A signal in coarse steps."""

import jax.numpy as jnp

from undertow.faults.mode import LARGE, READINGS, TARGET, AbstractMode, Altered, Severity


class Quantised(AbstractMode):
    """Rounded to multiples of a step."""

    targets = (*READINGS, "thruster")
    severity = Severity("step", TARGET, 0.5, 1e-9, LARGE)
    delays = False

    def init(self, value):
        return ()

    def apply(self, memory, moment, value):
        return Altered(moment.severity * jnp.round(value / moment.severity), jnp.asarray(True)), memory


def quantised() -> Quantised:
    """Rounded to multiples of the severity."""
    return Quantised()
