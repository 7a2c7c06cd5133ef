"""Drag that the model does not know."""

import jax.numpy as jnp

from undertow.core.contracts import ModelScaling
from undertow.disturbances.adding import with_scaling
from undertow.faults.mode import AbstractPlantFault, Severity


class Drag(AbstractPlantFault):
    """A factor on linear and quadratic damping."""

    targets = ("plant",)
    severity = Severity("additional share of the damping", "", 1.0, -1.0, 100.0)
    default_duration = float("inf")

    def load(self, presence, pose, load):
        one = jnp.ones(())
        return with_scaling(load, pose, ModelScaling(one, 1 + presence.size, one, one))


def drag() -> Drag:
    """More drag, such as that of growth or of something that is towed."""
    return Drag()
