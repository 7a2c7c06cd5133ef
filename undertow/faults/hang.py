"""A controller that is not computed."""

import jax.numpy as jnp

from undertow.faults.mode import NO_SEVERITY, AbstractComputationFault, Execution


class Hang(AbstractComputationFault):
    """No control step is computed: the last input is held, the state does not advance."""

    targets = ("computation",)
    severity = NO_SEVERITY
    default_duration = 1.0

    def execution(self, instant, dt):
        return Execution(jnp.asarray(False), dt)

    def state(self, instant, law, z, y, r):
        return z


def hang() -> Hang:
    """The computer hangs for a second, unless a duration is given, and then continues as if nothing had happened."""
    return Hang()
