"""No disturbance."""

from undertow.core.contracts import Load
from undertow.physics.disturbances.loads import AbstractSmoothDisturbance


class NoDisturbance(AbstractSmoothDisturbance):
    """Still water and no load."""

    def at(self, realization, t, pose, load: Load) -> Load:
        return load


def none() -> NoDisturbance:
    """No disturbance."""
    return NoDisturbance()
