"""How long the steps of a link take."""

from collections import deque

import numpy as np


class Latency:
    """Durations of the last steps, s.

    Args:
        kept: how many.
    """

    def __init__(self, kept: int = 10_000):
        self._durations: deque[float] = deque(maxlen=kept)

    def add(self, duration: float) -> None:
        """Note one step."""
        self._durations.append(duration)

    def milliseconds(self) -> dict[str, float]:
        """Median, 99th percentile and longest, ms; {} before the first step."""
        if not self._durations:
            return {}
        found = 1e3 * np.array(self._durations)
        return {"p50": float(np.median(found)), "p99": float(np.percentile(found, 99)), "max": float(found.max())}

    def __str__(self) -> str:
        return ", ".join(f"{name} {value:.2f} ms" for name, value in self.milliseconds().items()) or "no step yet"
