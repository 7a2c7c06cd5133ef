"""A controller that is computed twice."""

import jax.numpy as jnp

from undertow.faults.mode import AbstractComputationFault, Execution, Severity


class DuplicatedStep(AbstractComputationFault):
    """In every n-th control step the state advances twice."""

    targets = ("computation",)
    severity = Severity("control steps from one that is duplicated to the next", "", 5.0, 1.0, 1e6)
    default_duration = float("inf")

    def execution(self, instant, dt):
        again = instant.number % jnp.round(instant.severity).astype(int) == 0
        return Execution(jnp.asarray(True), dt, again)

    def state(self, instant, law, z, y, r):
        return z


def duplicated_step() -> DuplicatedStep:
    """Control steps in which the controller is computed twice, as where a message arrives twice."""
    return DuplicatedStep()
