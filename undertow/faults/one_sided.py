"""An actuator without the positive half of its range."""

import jax.numpy as jnp

from undertow.faults.mode import AbstractMode, Altered, Severity


class OneSided(AbstractMode):
    """Positive inputs are limited to less than negative ones."""

    targets = ("thruster", "bus")
    severity = Severity("largest positive input that is left, as a share of the largest", "", 0.0, 0.0, 1.0)
    delays = False

    def init(self, value):
        return ()

    def apply(self, memory, moment, value):
        return Altered(jnp.minimum(value, moment.severity), jnp.asarray(True)), memory


def one_sided() -> OneSided:
    """Positive inputs are limited, negative ones are not, as with half of a bridge that has failed."""
    return OneSided()
