"""numbalsoda: DOP853 and LSODA, called from loops that Numba compiles."""

import numba
import numpy as np
import rows
from numba_loops import of_solver, with_angles
from numbalsoda import dop853, lsoda, lsoda_sig
from pendulum import STIFFNESS


@numba.cfunc(lsoda_sig)
def field(t, y, slope, torque):
    slope[0], slope[1] = y[1], torque[0] - STIFFNESS * np.sin(y[0])


_FIELD = field.address


@numba.njit
def by_dop853(start, duration, torque, tolerance):
    y, _ = dop853(_FIELD, start, np.array([0.0, duration]), np.array([torque]), tolerance, tolerance)
    return y[-1]


@numba.njit
def by_lsoda(start, duration, torque, tolerance):
    y, _ = lsoda(_FIELD, start, np.array([0.0, duration]), np.array([torque]), tolerance, tolerance)
    return y[-1]


for name, solver in {"numbalsoda, DOP853": by_dop853, "numbalsoda, LSODA": by_lsoda}.items():
    free, sampled = of_solver(solver)
    rows.print_cheapest("alone", name, rows.TOLERANCES, with_angles(free))
    rows.print_cheapest("controlled", name, rows.TOLERANCES, with_angles(sampled))
