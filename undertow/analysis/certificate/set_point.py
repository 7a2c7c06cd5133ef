"""The Lyapunov function of the paper per axis, towards a set-point: Eqs. (46)-(60).

Eqs. (38), (41) and (45) define the best weights theta* and what they leave over; the basis sums to one, so both
are known in closed form.
"""

import numpy as np
import xarray as xr

from undertow.controllers.composite_law import RCAF


def lyapunov_function(law: RCAF, run: xr.Dataset, best_weight: np.ndarray) -> np.ndarray:
    """V_f of Eq. (46), one column per axis, along a recorded run.

    V_f = 1/2 E^T P E + gamma_eps/2 eps^2 + 1/(2 gamma) |theta - theta*|^2

    Args:
        law: the law that ran.
        run: recorded series, with velocities of the target zero (a set-point).
        best_weight: theta*, the same for all rules of an axis, m/s^2 and rad/s^2; d itself where d is constant.

    Returns:
        Array (time, axis).
    """
    error = np.stack([run["error"].values, -run["velocity"].values], axis=-1)
    p, eps = np.asarray(law.lyapunov()), run["modelling_error"].values
    departure = run["weights"].values - np.asarray(best_weight)[..., None]
    tracking = 0.5 * np.einsum("...i,...ij,...j", error, p, error)
    composite, adaptation = np.asarray(law.composite), np.asarray(law.adaptation)
    return tracking + 0.5 * composite * eps**2 + (departure**2).sum(-1) / (2 * adaptation)


def minimax_weight(run: xr.Dataset) -> np.ndarray:
    """theta* of Eq. (40) for a measured d: half-way between its extremes, for every axis.

    The basis sums to one, so no weights do better than the constant nearest to all values of d.
    """
    d = run["uncertainty"].values
    return (d.max(axis=0) + d.min(axis=0)) / 2


def share_increasing(values: np.ndarray, tolerance: float = 1e-10) -> float:
    """Share of steps, over all axes, at which V_f grows by more than `tolerance` of its first value."""
    return float((np.diff(values, axis=0) > tolerance * values[0]).mean())
