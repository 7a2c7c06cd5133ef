"""Bounds of the theory for a run: the residual set of U9, and the estimation error that |d_dot| allows."""

import numpy as np
import xarray as xr

from undertow.analysis.certificate.function import transition
from undertow.controllers.composite_law import RCAF
from undertow.controllers.robust.estimator import Estimator

# max over s of s (1 - tanh s).
_TANH = 0.27846454

# An impulse response is added up until it has fallen to this share, over this many steps at most.
_FORGOTTEN, _STEPS = 1e-12, 20_000


def residual(law: RCAF, axes: int) -> float:
    """What tanh adds to Vf_dot at most, all axes together: U9, I22. Zero with sign. m^2/s^3 and rad^2/s^3."""
    own = _layer(law.switching, law.robust_gain, law.layer)
    compensation = law.identification
    other = _layer(compensation.switching, compensation.compensation_gain, compensation.layer)
    return float(np.broadcast_to(own + np.asarray(law.composite) * other, axes).sum())


def _layer(switching: str, amplitude, layer):
    return _TANH * np.asarray(amplitude) * np.asarray(layer) if switching == "tanh" else np.zeros(())


def fastest(run: xr.Dataset) -> np.ndarray:
    """Largest |d_dot| of each axis from record to record, m/s^3 and rad/s^3."""
    steps = np.abs(np.diff(run["uncertainty"].values, axis=0)) / np.diff(run["time"].values)[:, None]
    return steps.max(axis=0, initial=0.0)


def estimation_error(estimator: Estimator, dt: float, rate: np.ndarray) -> np.ndarray:
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
    rows, row = np.zeros(step.shape[:1] + (2,)), np.tile([[0.0, 1.0]], (len(rate), 1))
    for _ in range(steps):
        rows += np.abs(row)
        row = np.einsum("ni,nij->nj", row, step)
    # In one step d moves by rate dt; its mean over the step is off by half of that, and eps by dt times as much.
    return rate * dt * (rows[:, 1] + dt / 2 * rows[:, 0])
