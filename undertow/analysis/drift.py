"""Parameter drift: gain added by drifting weights, and time to divergence. Section 3.8 of the theory page.

Weights that differ between sets give d_hat = z - c eps with c = -xi'(0)^T theta. Under the adaptive law c grows with
the square of eps and never decreases: it adds damping at first, and destabilises the sampled loop in the end.
"""

import numpy as np

from undertow.analysis.noise import Steps, steps
from undertow.controllers.composite_law import RCAF
from undertow.controllers.robust.robust_law import RobustRCAF
from undertow.core.errors import BadInput
from undertow.estimation.fuzzy_system import FuzzySystem


def basis_slope(fuzzy: FuzzySystem) -> np.ndarray:
    """xi'(0), one entry per set, s/m. Of sets on the modelling error only.

    Raises:
        BadInput: more than one input.
    """
    if fuzzy.inputs != 1:
        raise BadInput("fuzzy_input", "be error, because only this basis depends on eps", f"of {fuzzy.inputs} inputs")
    centres, widths = np.asarray(fuzzy.centres[0]), np.asarray(fuzzy.widths[0])
    exponent = -((centres / widths) ** 2)
    basis = np.exp(exponent - exponent.max())
    basis /= basis.sum()
    pull = 2 * centres / widths**2
    return basis * (pull - basis @ pull)


def gain_of(law: RCAF | RobustRCAF, weights: np.ndarray) -> np.ndarray:
    """c of weights theta (..., rules), 1/s."""
    return -np.asarray(weights) @ basis_slope(law.fuzzy)


def gain_bound(law: RCAF | RobustRCAF, axis: int = 0) -> float:
    """Largest c, 1/s, while |theta| <= theta_max: theta_max sum |xi'(0)|; zero for one set, infinite without a box."""
    theta_max = np.broadcast_to(np.asarray(law.weights_bound, dtype=float), len(law.model.coordinates.angles))[axis]
    slope = np.abs(basis_slope(law.fuzzy)).sum()
    return float(theta_max * slope) if slope > 0 else 0.0


def largest_gain(law: RCAF | RobustRCAF, dt: float, axis: int = 0) -> float:
    """c, 1/s, at which the estimator sampled every dt seconds is unstable: a pole at -1.

    For the paper's law 2 / dt + b2 dt / 2 - alpha - omega_bar / phi.
    """
    one = steps(law, dt, axis)
    return (2 - one.of_rates) / dt + one.of_estimate / 2


def is_certified(law: RCAF | RobustRCAF, dt: float, axis: int = 0) -> bool:
    """Whether no drift can make the estimator unstable at this sampling time: `gain_bound` < `largest_gain`."""
    return gain_bound(law, axis) < largest_gain(law, dt, axis)


def drift_rate(law: RCAF | RobustRCAF, dt: float, mean_square: float, axis: int = 0) -> float:
    """c_dot = gamma gamma_eps |xi'(0)|^2 mean(eps^2), 1/s^2, of a mean square in (m/s)^2."""
    return _per_square(law, steps(law, dt, axis)) * mean_square


def noise_square(law: RCAF | RobustRCAF, dt: float, velocity: float, gain: float = 0.0, axis: int = 0) -> float:
    """Mean square of eps, (m/s)^2, under white noise of a standard deviation `velocity`, with a gain c in 1/s.

    Of the estimator alone: eps = -(q - 1)^2 / ((q - 1)^2 + p (q - 1) + r) n, q the shift by one step.
    """
    one = steps(law, dt, axis)
    p, r = one.of_rates + dt * gain, one.of_estimate * dt
    return velocity**2 * 2 * (2 * p - r) / ((p - r) * (4 - 2 * p + r))


def time_to_divergence(law: RCAF | RobustRCAF, dt: float, velocity: float, axis: int = 0) -> float:
    """Time, s, in which white velocity noise drives c from zero to `largest_gain`; infinite where it cannot."""
    from scipy.integrate import quad  # takes longer to import than all a run needs

    one, end = steps(law, dt, axis), largest_gain(law, dt, axis)
    rate = _per_square(law, one) * velocity**2
    if rate == 0 or gain_bound(law, axis) < end:
        return float("inf")
    start, r = one.of_rates, one.of_estimate * dt
    slowness = lambda p: (p - r) * (4 - 2 * p + r) / (2 * (2 * p - r))  # 1 / `noise_square`
    return float(quad(slowness, start, start + dt * end)[0] / dt / rate)


def _per_square(law: RCAF | RobustRCAF, one: Steps) -> float:
    return one.of_estimate / one.dt / one.basis_norm_squared * float((basis_slope(law.fuzzy) ** 2).sum())
