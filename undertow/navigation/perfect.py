"""The truth."""

import equinox as eqx

from undertow.core.contracts import AbstractSensor, Measurement


class Perfect(AbstractSensor):
    """Measures exactly."""

    smooth: bool = eqx.field(static=True, default=True)

    def draw(self, key) -> tuple[()]:
        return ()

    def init(self, path, truth) -> tuple[()]:
        return ()

    def measure(self, path, state, t, truth: Measurement):
        return truth, ()


def perfect() -> Perfect:
    """Measurements without error."""
    return Perfect()
