"""A signal that is not a number."""

import jax.numpy as jnp

from undertow.faults.mode import NO_SEVERITY, READINGS, AbstractMode, Altered


class Nan(AbstractMode):
    """Not a number (NaN) in every entry."""

    targets = READINGS
    severity = NO_SEVERITY
    delays = False

    def init(self, value):
        return ()

    def apply(self, memory, moment, value):
        return Altered(jnp.full_like(value, jnp.nan), jnp.asarray(True)), memory


def nan() -> Nan:
    """Readings that are not a number."""
    return Nan()
