"""The Lyapunov function of a controller from recorded signals: Eqs. (45)-(60), and section X4 of the theory.

Eqs. (38), (41) and (45) define the best weights theta* and what they leave over; the basis sums to one, so both are
known in closed form. With theta* = d(t) 1 these weights are exact at every instant (U6 of the theory). While d moves
they move, and the function may rise.
"""

from typing import NamedTuple

import numpy as np
import xarray as xr
from jaxtyping import Array, Float

from undertow.control.controllers.composite_law import RCAF
from undertow.control.controllers.robust.estimator import Estimator
from undertow.control.controllers.robust.robust_law import RobustRCAF
from undertow.control.estimation.fuzzy_system import FuzzySystem
from undertow.core.arrays import as_array
from undertow.core.kept_programs import kept_program

PerRecord = np.ndarray  # (time,)


class Lyapunov(NamedTuple):
    """V along a run, m^2/s^2 and rad^2/s^2, summed over axes."""

    meaning: str
    value: PerRecord
    estimation: PerRecord | None = None  # part of the modelling error and the weights; the rest is that of tracking


def of_paper(law: RCAF, run: xr.Dataset) -> Lyapunov:
    """V_f = 1/2 E^T P E + gamma_eps/2 eps^2 + |theta - theta*|^2 / (2 gamma), Eq. (46). No gamma, no third part."""
    adaptation = np.broadcast_to(law.adaptation, run.sizes["axis"])
    per_weight = np.divide(1.0, adaptation, out=np.zeros(adaptation.shape), where=adaptation > 0)
    terms = np.asarray(law.composite) * run["modelling_error"].values ** 2 + per_weight * _departure(run)
    estimation = terms.sum(-1) / 2
    return Lyapunov("V_f of Eq. (46)", run["lyapunov_tracking"].values + estimation, estimation)


def of_set_point(law: RCAF, run: xr.Dataset) -> np.ndarray:
    """V_f of Eq. (46), one column per axis, along a run towards a set-point, with `minimax_weight`: (time, axis)."""
    error = np.stack([run["error"].values, -run["velocity"].values], axis=-1)
    p = np.asarray(law.lyapunov())
    eps = run["modelling_error"].values
    departure = run["weights"].values - minimax_weight(run)[..., None]
    tracking = 0.5 * np.einsum("...i,...ij,...j", error, p, error)
    composite, adaptation = np.asarray(law.composite), np.asarray(law.adaptation)
    return tracking + 0.5 * composite * eps**2 + (departure**2).sum(-1) / (2 * adaptation)


def minimax_weight(run: xr.Dataset) -> np.ndarray:
    """theta* of Eq. (40) for a measured d: half-way between its extremes, for every axis; d itself where constant.

    The basis sums to one, so no weights do better than the constant nearest to all values of d.
    """
    d = run["uncertainty"].values
    return (d.max(axis=0) + d.min(axis=0)) / 2


def share_increasing(values: np.ndarray) -> float:
    """Share of steps, over all axes, at which V_f grows by more than 1e-10 of its first value. Eq. (58)."""
    return float((np.diff(values, axis=0) > 1e-10 * values[0]).mean())


def of_robust(law: RobustRCAF, run: xr.Dataset, dt: float) -> Lyapunov:
    """The estimator's own function, V_eps, and V_f = 1/2 E^T P E + gamma_eps V_eps where mu = 1 / gamma_eps > 0.

    V_eps is eps^2/2 + |theta - theta*|^2 / (2 gamma gamma_eps) of section X4 in discrete time: see `gramian`.
    """
    matrix = gramian(law.estimator, dt, run.sizes["axis"])
    d_til = run["estimate"].values - run["uncertainty"].values
    eps = run["modelling_error"].values
    rho = float(size_of_basis(law.estimator.fuzzy))
    per_axis = matrix[:, 0, 0] * eps**2 + 2 * matrix[:, 0, 1] * eps * d_til + matrix[:, 1, 1] * rho * _departure(run)
    share = np.broadcast_to(law.tracking_share, eps.shape[1:])
    if not (share > 0).all():
        value = per_axis.sum(-1)
        return Lyapunov("V_eps of the estimator alone (mu = 0)", value, value)
    estimation = (per_axis / share).sum(-1)
    return Lyapunov("V_f of Eq. (46), gamma_eps = 1/mu", run["lyapunov_tracking"].values + estimation, estimation)


def transition(estimator: Estimator, dt: float, axes: int) -> np.ndarray:
    """Matrix of (eps, d_hat - d) from one step to the next, per axis, for constant d and basis: poles at exp(p T)."""
    of_rates, of_estimate = (np.broadcast_to(gain, axes) for gain in _gains(estimator, as_array(dt)))
    ones = np.ones(axes)
    return np.stack([np.stack([1 - of_rates, dt * ones], -1), np.stack([-of_estimate, ones], -1)], -2)


@kept_program
def size_of_basis(fuzzy: FuzzySystem) -> Float[Array, ""]:
    """|xi(0)|^2."""
    return fuzzy.basis_norm_squared()


@kept_program
def _gains(estimator: Estimator, dt: Float[Array, ""]) -> tuple[Float[Array, "..."], Float[Array, "..."]]:
    return estimator.gains(dt)


def gramian(estimator: Estimator, dt: float, axes: int) -> np.ndarray:
    """W per axis with l_1 sum of eps^2 over this and all later steps = x^T W x, x = (eps, d_hat - d), l_1 = 1 - A_11.

    So x^T W x falls by exactly l_1 eps^2 per step, at any sampling time. For short ones W comes to
    diag(1, 1 / (gamma gamma_eps |xi|^2)) / 2.
    """
    step = transition(estimator, dt, axes)
    start = np.zeros((2, 2))
    start[0, 0] = 1.0
    propagation = np.einsum("nji,nlk->nikjl", step, step).reshape(axes, 4, 4)  # vec(A^T W A) = propagation vec(W)
    fall = (1 - step[:, 0, 0])[:, None] * start.ravel()
    return np.linalg.solve(np.eye(4) - propagation, fall[..., None]).reshape(axes, 2, 2)


def _departure(run: xr.Dataset) -> np.ndarray:
    """|theta - d 1|^2, (time, axis)."""
    return ((run["weights"].values - run["uncertainty"].values[..., None]) ** 2).sum(-1)


# max over s of s (1 - tanh s).
_TANH = 0.27846454

# An impulse response is added up until it has fallen to this share, over this many steps at most.
_FORGOTTEN, _STEPS = 1e-12, 20_000
_AT_ONCE = 64  # powers of a matrix


def lyapunov_residual(law: RCAF, axes: int) -> float:
    """What tanh adds to Vf_dot at most, all axes together: U9, I22. Zero with sign. m^2/s^3 and rad^2/s^3."""
    robust_share = _layer(law.switching, law.robust_gain, law.layer)
    compensation = law.identification
    identification_share = _layer(
        compensation.switching, compensation.compensation_gain, compensation.compensation_layer
    )
    return float(np.broadcast_to(robust_share + np.asarray(law.composite) * identification_share, axes).sum())


def _layer(switching: str, amplitude, layer):
    return _TANH * np.asarray(amplitude) * np.asarray(layer) if switching == "tanh" else np.zeros(())


def fastest_uncertainty(run: xr.Dataset) -> np.ndarray:
    """Largest |d_dot| of each axis from record to record, m/s^3 and rad/s^3.

    With a memory it is that of d less the memory, at the weights of each step: what the memory takes over from the
    observer moves nothing.
    """
    d = run["uncertainty"].values
    if "memory" in run:
        d = d - run["memory"].values + run["memory_taken"].values
    steps = np.abs(np.diff(d, axis=0)) / np.diff(run["time"].values)[:, None]
    return steps.max(axis=0, initial=0.0)


def estimation_bound(estimator: Estimator, dt: float, rate: np.ndarray) -> np.ndarray:
    """Largest |d_hat - d| per axis once the start is forgotten, where |d_dot| <= rate: an L1 norm.

    It holds for the exact poles, free of noise, with weights off their bound, as long as the basis does not change.

    Args:
        estimator: of the law.
        dt: sampling time, s.
        rate: largest |d_dot| of each axis, m/s^3 and rad/s^3.
    """
    step = transition(estimator, dt, len(rate))
    slowest = np.abs(np.linalg.eigvals(step)).max()
    steps = _STEPS if slowest >= 1 else min(_STEPS, int(np.ceil(np.log(_FORGOTTEN) / np.log(slowest))) + 2)
    # The second rows of the powers of the matrix, as many at once as `_AT_ONCE`.
    powers = np.stack([np.linalg.matrix_power(step, power) for power in range(_AT_ONCE)])
    further, row = np.linalg.matrix_power(step, _AT_ONCE), np.tile([[[0.0, 1.0]]], (len(rate), 1, 1))
    rows = np.zeros((len(rate), 2))
    for first in range(0, steps, _AT_ONCE):
        rows += np.abs(row @ powers[: steps - first]).sum(axis=(0, 2))
        row = row @ further
    # In one step d moves by rate dt; its mean over the step is off by half of that, and eps by dt times as much.
    return rate * dt * (rows[:, 1] + dt / 2 * rows[:, 0])
