"""Loops over the runs and their samples, compiled by Numba."""

import numba
import numpy as np
from pendulum import ANGLES, DURATION, GAINS, LIMIT, SAMPLE, SAMPLES

_P, _D = GAINS


@numba.njit
def law(t, angle, rate):
    return min(max(-_P * (angle - np.sin(t)) - _D * rate, -LIMIT), LIMIT)


def of_solver(solver):
    """The two problems by a solver that is started anew for every sample."""

    @numba.njit
    def free(angles, tolerance):
        ends = np.empty_like(angles)
        for i, angle in enumerate(angles):
            ends[i] = solver(np.array([angle, 0.0]), DURATION, 0.0, tolerance)[0]
        return ends

    @numba.njit
    def sampled(angles, tolerance):
        ends = np.empty_like(angles)
        for i, angle in enumerate(angles):
            y = np.array([angle, 0.0])
            for k in range(SAMPLES):
                y = solver(y, SAMPLE, law(k * SAMPLE, y[0], y[1]), tolerance).copy()
            ends[i] = y[0]
        return ends

    return free, sampled


def with_angles(function):
    return lambda setting: lambda: function(ANGLES, setting)
