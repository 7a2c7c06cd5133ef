"""A controller that is restarted."""

import jax
import jax.numpy as jnp

from undertow.faults.mode import NO_SEVERITY, AbstractComputationFault, Execution


class Reload(AbstractComputationFault):
    """The state of the law begins anew from the measurement of the onset."""

    targets = ("computation",)
    severity = NO_SEVERITY
    default_duration = float("inf")

    def execution(self, instant, dt):
        return Execution(jnp.asarray(True), dt)

    def state(self, instant, law, z, y, r):
        first, fresh = instant.active & (instant.number == 0), law.init(y, r)
        return jax.tree.map(lambda new, old: jnp.where(first, new, old), fresh, z)


def reload() -> Reload:
    """The controller is restarted in the middle of a run."""
    return Reload()
