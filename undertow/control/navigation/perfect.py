"""Measurement of the true state."""

import equinox as eqx

from undertow.core.contracts import AbstractNavigation, Measurement


class Perfect(AbstractNavigation):
    """Measures exactly."""

    smooth: bool = eqx.field(static=True, default=True)

    def realize(self, key) -> tuple[()]:
        return ()

    def init(self, realization, truth) -> tuple[()]:
        return ()

    def measure(self, realization, state, t, truth: Measurement):
        return truth, ()


def perfect() -> Perfect:
    """Measurements without error."""
    return Perfect()
