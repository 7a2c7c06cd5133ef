"""A sampling time that is measured with errors."""

import jax.numpy as jnp

from undertow.faults.mode import AbstractComputationFault, Execution, Severity

# Multiples of the golden section, modulo one, fill (0, 1) evenly: H. Weyl, Math. Ann. 77 (1916).
_GOLDEN = 0.6180339887498949


class Jitter(AbstractComputationFault):
    """The sampling time that the law is given differs from the true one in each step, uniformly distributed."""

    targets = ("computation",)
    severity = Severity("largest error as a share of the sampling time", "", 0.8, 0.0, 100.0)
    default_duration = float("inf")

    def execution(self, instant, dt):
        place = _GOLDEN * jnp.asarray(instant.number, dtype=float)
        return Execution(jnp.asarray(True), dt * (1 + instant.severity * (2 * (place - jnp.floor(place)) - 1)))

    def state(self, instant, law, z, y, r):
        return z


def jitter() -> Jitter:
    """Errors of the measured sampling time, other ones in every step."""
    return Jitter()
