"""Calm water."""

from undertow.core.contracts import AbstractDisturbance, Load


class NoDisturbance(AbstractDisturbance):
    """Nothing at all."""

    def realize(self, key) -> tuple[()]:
        return ()

    def at(self, realization, t, pose, load: Load) -> Load:
        return load

    def jumps(self, duration: float) -> tuple[float, ...]:
        return ()


def none() -> NoDisturbance:
    """No disturbance."""
    return NoDisturbance()
