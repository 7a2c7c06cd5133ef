"""Calm water."""

from undertow.core.contracts import AbstractDisturbance, Load


class NoDisturbance(AbstractDisturbance):
    """Nothing at all."""

    def draw(self, key) -> tuple[()]:
        return ()

    def at(self, path, t, place, calm: Load) -> Load:
        return calm

    def jumps(self, duration: float) -> tuple[float, ...]:
        return ()


def none() -> NoDisturbance:
    """No disturbance."""
    return NoDisturbance()
