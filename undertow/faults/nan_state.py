"""A number of the state of a controller that is lost."""

import equinox as eqx
import jax.numpy as jnp

from undertow.faults.mode import NO_SEVERITY, AbstractComputationFault, Execution
from undertow.faults.numbers_of_state import with_entry


class NanState(AbstractComputationFault):
    """One number becomes NaN once, at the onset."""

    entry: int | None = eqx.field(static=True)  # from 1; None for the numbers of the largest magnitude

    targets = ("computation",)
    severity = NO_SEVERITY
    default_duration = float("inf")

    def execution(self, instant, dt):
        return Execution(jnp.asarray(True), dt)

    def state(self, instant, law, z, y, r):
        first = instant.active & (instant.number == 0)
        return with_entry(z, self.entry, first, lambda number: jnp.full_like(number, jnp.nan))


def nan_state(entry: int | None = None) -> NanState:
    """A number in the memory of the controller is not a number any more.

    Args:
        entry: which number of the state, from 1; by default that of the largest magnitude.
    """
    return NanState(entry)
