"""A controller that takes longer than a sampling time."""

import jax.numpy as jnp

from undertow.faults.mode import AbstractComputationFault, Execution, Severity


class Overrun(AbstractComputationFault):
    """A computation takes several sampling times, during which the last input is held."""

    targets = ("computation",)
    severity = Severity("sampling times that a computation takes beyond one", "", 2.0, 1.0, 1e6)
    default_duration = float("inf")

    def execution(self, instant, dt):
        length = 1 + jnp.round(instant.severity)
        return Execution(instant.number % length.astype(int) == 0, dt * length)

    def state(self, instant, law, z, y, r):
        return z


def overrun() -> Overrun:
    """The controller is computed in one of several control steps only, and measures the time since the last."""
    return Overrun()
