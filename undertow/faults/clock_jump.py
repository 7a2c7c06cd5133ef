"""A clock that jumps."""

import jax.numpy as jnp

from undertow.faults.mode import AbstractComputationFault, Execution, Severity


class ClockJump(AbstractComputationFault):
    """In the step of the onset the law is given another sampling time."""

    targets = ("computation",)
    severity = Severity(
        "sampling time that the controller is given once; negative where the clock goes back", "s", -1.0, -1e9, 1e9
    )
    default_duration = float("inf")

    def execution(self, instant, dt):
        return Execution(jnp.asarray(True), jnp.where(instant.number == 0, instant.severity, dt))

    def state(self, instant, law, z, y, r):
        return z


def clock_jump() -> ClockJump:
    """A jump of the clock: the controller is given a wrong sampling time once."""
    return ClockJump()
