"""Parameter drift: gain added by drifting weights, and time to divergence. Section 3.8 of the theory page.

Weights that differ between sets give d_hat = z - c eps with c = -xi'(0)^T theta. Under the adaptive law c grows with
the square of eps and never decreases: it adds damping at first, and destabilises the sampled loop in the end.
"""

import functools

import numpy as np

from undertow.analysis.small_signal import gains, of_axis
from undertow.control.controllers.composite_law import RCAF
from undertow.control.controllers.robust.robust_law import RobustRCAF
from undertow.control.estimation.fuzzy_system import FuzzySystem
from undertow.core.arrays import as_array
from undertow.core.errors import BadInput


@functools.singledispatch
def corrections(law: RCAF | RobustRCAF, dt: float, axis: int = 0) -> tuple[float, float]:
    """Corrections per eps in one step of dt seconds: of x_hat_dot, and of d_hat in 1/s. Each class registers its own.

    Raises:
        BadInput: the paper's law with several steps per step, or with a `sign` switch; a law of another class.
    """
    raise BadInput("law", "be the paper's or the robust one", f"a {type(law).__name__}")


@corrections.register
def _paper(law: RCAF, dt: float, axis: int = 0) -> tuple[float, float]:
    if (law.method, law.substeps) != ("euler", 1):
        raise BadInput("method", "be euler with one step per step", f"{law.method} with {law.substeps}")
    g = gains(law, axis)
    return dt * g.pole, dt * g.b2


@corrections.register
def _robust(law: RobustRCAF, dt: float, axis: int = 0) -> tuple[float, float]:
    of_rates, of_estimate = law.estimator.gains(as_array(dt))
    return float(of_axis(law, of_rates, axis)), float(of_axis(law, of_estimate, axis))


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
    slope = np.abs(basis_slope(law.fuzzy)).sum()
    return float(of_axis(law, law.weights_bound, axis) * slope) if slope > 0 else 0.0


def largest_gain(law: RCAF | RobustRCAF, dt: float, axis: int = 0) -> float:
    """c, 1/s, at which the estimator sampled every dt seconds is unstable: a pole at -1.

    For the paper's law 2 / dt + b2 dt / 2 - alpha - omega_bar / phi.
    """
    of_rates, of_estimate = corrections(law, dt, axis)
    return (2 - of_rates) / dt + of_estimate / 2


def time_to_divergence(law: RCAF | RobustRCAF, dt: float, velocity: float) -> float:
    """Time, s, in which white velocity noise drives c of the first axis to `largest_gain`; infinite where it cannot.

    c_dot = gamma gamma_eps |xi'(0)|^2 mean(eps^2). Of the estimator alone, with n the noise of standard deviation
    `velocity` and q the shift by one step: eps = -(q - 1)^2 / ((q - 1)^2 + p (q - 1) + r) n.
    """
    from scipy.integrate import quad  # takes longer to import than all a run needs

    (start, of_estimate), end = corrections(law, dt), largest_gain(law, dt)
    squared_slope = float((basis_slope(law.fuzzy) ** 2).sum())
    rate = of_estimate / dt / float(law.fuzzy.basis_norm_squared()) * squared_slope * velocity**2
    if rate == 0 or gain_bound(law) < end:
        return float("inf")
    r = of_estimate * dt
    slowness = lambda p: (p - r) * (4 - 2 * p + r) / (2 * (2 * p - r))  # 1 / mean(eps^2), p = start + c dt
    return float(quad(slowness, start, start + dt * end)[0] / dt / rate)
