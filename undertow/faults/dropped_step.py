"""A controller that misses steps."""

import jax.numpy as jnp

from undertow.faults.mode import AbstractComputationFault, Execution, Severity


class DroppedStep(AbstractComputationFault):
    """Every n-th control step is left out: the last input is held, the state does not advance."""

    targets = ("computation",)
    severity = Severity("control steps from one that is dropped to the next", "", 5.0, 1.0, 1e6)
    default_duration = float("inf")

    def execution(self, instant, dt):
        return Execution(instant.number % jnp.round(instant.severity).astype(int) != 0, dt)

    def state(self, instant, law, z, y, r):
        return z


def dropped_step() -> DroppedStep:
    """Control steps that are left out, of which the controller does not know."""
    return DroppedStep()
