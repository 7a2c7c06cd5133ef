"""A bit of the state of a controller that flips."""

import equinox as eqx
import jax.numpy as jnp

from undertow.faults.mode import AbstractComputationFault, Execution, Severity
from undertow.faults.numbers_of_state import flipped, with_entry


class BitFlip(AbstractComputationFault):
    """One bit of a number flips once, at the onset. A number of zero may stay the same."""

    entry: int | None = eqx.field(static=True)  # from 1; None for the numbers of the largest magnitude

    targets = ("computation",)
    severity = Severity("bit, from 0 for the sign; 1 is the largest of the exponent", "", 8.0, 0.0, 31.0)
    default_duration = float("inf")

    def execution(self, instant, dt):
        return Execution(jnp.asarray(True), dt)

    def state(self, instant, law, z, y, r):
        first = instant.active & (instant.number == 0)
        return with_entry(z, self.entry, first, lambda number: flipped(number, instant.severity))


def bit_flip(entry: int | None = None) -> BitFlip:
    """A bit flips in the memory of the controller.

    Args:
        entry: which number of the state, from 1; by default that of the largest magnitude.
    """
    return BitFlip(entry)
