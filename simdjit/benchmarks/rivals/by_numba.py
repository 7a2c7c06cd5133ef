"""Numba: the loops written by hand, one run after the other."""

import numba
import numpy as np
import rows
from numba_loops import law, with_angles
from pendulum import DURATION, SAMPLE, SAMPLES, STIFFNESS


@numba.njit
def step(angle, rate, torque, h):
    a1 = torque - STIFFNESS * np.sin(angle)
    r2, a2 = rate + h / 2 * a1, torque - STIFFNESS * np.sin(angle + h / 2 * rate)
    r3, a3 = rate + h / 2 * a2, torque - STIFFNESS * np.sin(angle + h / 2 * r2)
    r4, a4 = rate + h * a3, torque - STIFFNESS * np.sin(angle + h * r3)
    return angle + h / 6 * (rate + 2 * r2 + 2 * r3 + r4), rate + h / 6 * (a1 + 2 * a2 + 2 * a3 + a4)


@numba.njit
def fixed(angles, steps):
    ends, h = np.empty_like(angles), DURATION / steps
    for i, angle in enumerate(angles):
        rate = 0.0
        for _ in range(steps):
            angle, rate = step(angle, rate, 0.0, h)
        ends[i] = angle
    return ends


@numba.njit
def fixed_controlled(angles, parts):
    ends = np.empty_like(angles)
    for i, angle in enumerate(angles):
        rate = 0.0
        for k in range(SAMPLES):
            torque = law(k * SAMPLE, angle, rate)
            for _ in range(parts):
                angle, rate = step(angle, rate, torque, SAMPLE / parts)
        ends[i] = angle
    return ends


rows.print_cheapest("alone", "Numba, order 4 by hand", rows.STEPS, with_angles(fixed))
rows.print_cheapest("controlled", "Numba, order 4 by hand", rows.PARTS, with_angles(fixed_controlled))
