"""By how much later one stream of a log comes than another."""

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np


class ClockOffset(NamedTuple):
    """How much later a stream comes than it should, s.

    Attributes:
        delay: positive where it comes later.
        deviation: standard error; infinite where the motion does not tell.
    """

    delay: float
    deviation: float

    def is_worth_saying(self, smallest: float) -> bool:
        """Whether it is surely larger than a time in s."""
        return abs(self.delay) > smallest + 3 * self.deviation

    def __str__(self) -> str:
        return f"{abs(self.delay):.2f} +- {self.deviation:.1g} s"


def offset_of(errors: Sequence[float], offsets: np.ndarray, independent: float) -> ClockOffset:
    """The offset at which two streams agree best: the vertex of a parabola through the logarithm of the errors.

    Args:
        errors: mean sizes of what remains at each offset.
        offsets: evenly spaced, s.
        independent: number of independent differences behind each error.
    """
    sizes = np.log(np.maximum(np.nan_to_num(np.asarray(errors), nan=np.inf), 1e-12))
    best = int(np.clip(np.argmin(sizes), 1, len(sizes) - 2))
    before, here, after = (float(size) for size in sizes[best - 1 : best + 2])
    curvature = before - 2 * here + after
    if not (curvature > 0 and math.isfinite(curvature)):
        return ClockOffset(0.0, math.inf)
    spacing = float(offsets[1] - offsets[0])
    vertex = float(offsets[best]) + spacing * min(max((before - after) / (2 * curvature), -1.0), 1.0)
    return ClockOffset(vertex, spacing / math.sqrt(curvature * max(1.0, independent)))
