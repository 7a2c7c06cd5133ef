"""CyRK: its solver in C++, called from loops that Numba compiles."""

import numba
import numpy as np
import rows
from CyRK import nb_diffeq_addr, nbsolve2_ivp
from numba_loops import of_solver, with_angles
from pendulum import STIFFNESS


def field(slope, t, y, torque):
    slope[0], slope[1] = y[1], torque[0] - STIFFNESS * np.sin(y[0])


_FIELD = nb_diffeq_addr(field)


@numba.njit
def end(start, duration, torque, tolerance):
    found = nbsolve2_ivp(
        _FIELD, (0.0, duration), start, "DOP853", args=np.array([torque]), rtol=tolerance, atol=tolerance
    )
    last = found.y[:, -1].copy()
    found.free()
    return last


free, sampled = of_solver(end)
rows.print_cheapest("alone", "CyRK, DOP853", rows.TOLERANCES, with_angles(free))
rows.print_cheapest("controlled", "CyRK, DOP853", rows.TOLERANCES, with_angles(sampled))
