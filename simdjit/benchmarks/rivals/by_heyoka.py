"""heyoka.py: Taylor series of an order that it chooses, for one or several vector registers of runs at once."""

from functools import partial

import heyoka as hy
import numpy as np
import rows
from pendulum import ANGLES, DURATION, LIMIT, RUNS, SAMPLE, SAMPLES, STIFFNESS, command

TOLERANCES = rows.TOLERANCES.values
WIDTHS = hy.recommended_simd_size(), 64, 256  # runs of a batch
ANGLE, RATE = hy.make_vars("angle", "rate")
TORQUE = hy.par[0]


def integrator(width, torque, tolerance):
    equations = [(ANGLE, RATE), (RATE, torque - STIFFNESS * hy.sin(ANGLE))]
    return hy.taylor_adaptive_batch(equations, np.zeros((2, width)), tol=tolerance)


def begin(taylor, angles):
    taylor.set_time(0.0)
    taylor.state[:] = angles, np.zeros_like(angles)


def batch(width, tolerance):
    taylor = integrator(width, 0.0, tolerance)

    def end(angles):
        begin(taylor, angles)
        taylor.propagate_until(DURATION)
        return taylor.state[0].copy()

    return lambda: np.concatenate([end(group) for group in ANGLES.reshape(-1, width)])


def ensemble(width, tolerance):
    groups, taylor = ANGLES.reshape(-1, width), integrator(width, 0.0, tolerance)

    def begun(taylor, i):
        begin(taylor, groups[i])
        return taylor

    def work():
        found = hy.ensemble_propagate_until_batch(taylor, DURATION, RUNS // width, begun)
        return np.concatenate([one[0].state[0] for one in found])

    return work


def controlled(width, tolerance):
    taylor = integrator(width, TORQUE, tolerance)

    def end(angles):
        begin(taylor, angles)
        for k in range(SAMPLES):
            taylor.pars[0] = np.clip(command(np.sin(k * SAMPLE), *taylor.state), -LIMIT, LIMIT)
            taylor.propagate_until((k + 1) * SAMPLE)
        return taylor.state[0].copy()

    return lambda: np.concatenate([end(group) for group in ANGLES.reshape(-1, width)])


def of_widths(problem, tool, work):
    """Print a row for each width."""
    for width in WIDTHS:
        rows.print_cheapest(
            problem, tool, rows.Settings(f"tolerance {{:.0e}}, {width} at once", TOLERANCES), partial(work, width)
        )


of_widths("alone", "heyoka, batch", batch)
of_widths("alone", "heyoka, ensemble of batches", ensemble)
of_widths("controlled", "heyoka, batch, law in NumPy", controlled)
