"""Dives as integrals over windows, with which the equation of motion is multiplied in the weak form."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from undertow.studies.identification.dive import Dive
from undertow.studies.identification.gap_filling import filled, usable_axes
from undertow.studies.identification.segments import Segments, segments_of

_WINDOW = 1.5  # s; longer than thrusters need to answer, shorter than what drag needs to stop a vehicle
_SEGMENT = 10 * _WINDOW


class WeakProblem(NamedTuple):
    """Dives as integrals over windows.

    Attributes:
        segments: of dives without gaps, (S, ...).
        test: functions that vanish outside of windows, (W, length), of integral 1.
        slope: their derivatives, 1/s.
        usable: of each window and equation, (S, W, 6).
        step: s.
    """

    segments: Segments
    test: np.ndarray
    slope: np.ndarray
    usable: np.ndarray
    step: float


def weak_problem(dives: Sequence[Dive]) -> WeakProblem:
    """Integrals over windows of dives with equal steps."""
    step = dives[0].step
    segments = segments_of([filled(dive) for dive in dives], _SEGMENT)
    length = segments.values.shape[1]
    test, slope = _test_functions(length, step)
    inside = (test > 0).astype(float)
    measured = np.einsum("wk,skc->swc", inside, (segments.counts > 0).astype(float))
    complete = measured >= inside.sum(axis=1)[:, None]
    return WeakProblem(segments, test, slope, usable_axes(complete), step)


def _test_functions(length: int, step: float) -> tuple[np.ndarray, np.ndarray]:
    """(1 - s^2)^3 over windows that overlap by half, and its derivative."""
    width = min(length, max(8, round(_WINDOW / step)))
    s = 2 * (np.arange(width) + 0.5) / width - 1
    test = (1 - s**2) ** 3
    slope = -6 * s * (1 - s**2) ** 2
    test /= test.sum()
    # Scaled such that a ramp has exactly its own slope: the sum would be off by the square of the step.
    slope /= -(slope * step * np.arange(width)).sum()
    starts = range(0, length - width + 1, max(1, width // 2))
    rows = np.zeros((2, len(starts), length))
    for row, start in enumerate(starts):
        rows[0, row, start : start + width] = test
        rows[1, row, start : start + width] = slope
    return rows[0], rows[1]
