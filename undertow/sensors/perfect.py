"""The truth."""

from undertow.core.contracts import AbstractSensor, Measurement


class Perfect(AbstractSensor):
    """Measures exactly."""

    def draw(self, key) -> tuple[()]:
        return ()

    def measure(self, path, t, truth: Measurement) -> Measurement:
        return truth


def perfect() -> Perfect:
    """Measurements without error."""
    return Perfect()
