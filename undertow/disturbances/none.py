"""No disturbance."""

from undertow.core.contracts import AbstractDisturbance, Load


class NoDisturbance(AbstractDisturbance):
    """Still water and no load."""

    def realize(self, key) -> tuple[()]:
        return ()

    def at(self, realization, t, pose, load: Load) -> Load:
        return load

    def jumps(self, duration: float) -> tuple[float, ...]:
        return ()


def none() -> NoDisturbance:
    """No disturbance."""
    return NoDisturbance()
