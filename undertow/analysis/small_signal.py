"""Small-signal model of the controller: poles, frequency responses and limits in closed form.

The basis functions sum to one and eps stays small, so the fuzzy estimate behaves as one integrator with the gain
rho = |xi(0)|^2. Per axis, on x_ddot = u + d with an exact model and actuator, this leaves four linear states
(e, e_dot, eps, d_til), d_til = d_hat - d, driven by d_dot: sections 3.1 to 3.7 of the theory page. Everything here
is a plain number of one axis of a law, in SI units.
"""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from scipy.linalg import expm

from undertow.controllers.composite_law import RCAF
from undertow.core.errors import BadInput

RULES = ("euler", "exact")  # how the law's own state is advanced over one sampling time


class Gains(NamedTuple):
    """Small-signal gains of one axis."""

    stiffness: float  # k1 + kr p12, 1/s^2: K plus the slope kr = w_bar / phi of the robust term
    damping: float  # k2 + kr p22, 1/s
    p12: float  # s = p12 e + p22 e_dot
    p22: float
    pole: float  # a1 = alpha_F + omega_bar / phi, 1/s
    adaptation: float  # gamma rho
    composite: float  # gamma_eps

    @property
    def b2(self) -> float:
        """gamma gamma_eps rho, 1/s^2: the square of the observer's natural frequency."""
        return self.adaptation * self.composite


def gains(law: RCAF, axis: int = 0) -> Gains:
    """Small-signal gains of one axis. Section 3.1.

    Raises:
        BadInput: a `sign` switch has no slope.
    """
    if "sign" in (law.switching, law.identification.switching):
        raise BadInput("switching", "be tanh for a small-signal prediction", "sign")
    feedback = _of_axis(law.feedback, axis, 1)
    lyapunov = _of_axis(law.lyapunov(), axis, 2)
    p12, p22 = lyapunov[0, 1], lyapunov[1, 1]
    slope = _number(law.robust_gain, axis) / _number(law.layer, axis)
    model = law.identification
    return Gains(
        stiffness=float(feedback[0] + slope * p12),
        damping=float(feedback[1] + slope * p22),
        p12=float(p12),
        p22=float(p22),
        pole=_number(model.pole, axis)
        + _number(model.compensation_gain, axis) / _number(model.compensation_layer, axis),
        adaptation=_number(law.adaptation, axis) * float(law.fuzzy.basis_norm_squared()),
        composite=_number(law.composite, axis),
    )


def system_matrix(law: RCAF, axis: int = 0) -> np.ndarray:
    """A (4 x 4) of d/dt (e, e_dot, eps, d_til) = A (...) - (0, 0, 0, 1) d_dot. Section 3.1."""
    g = gains(law, axis)
    return np.array(
        [
            [0.0, 1.0, 0.0, 0.0],
            [-g.stiffness, -g.damping, 0.0, 1.0],
            [0.0, 0.0, -g.pole, 1.0],
            [-g.adaptation * g.p12, -g.adaptation * g.p22, -g.b2, 0.0],
        ]
    )


def poles(law: RCAF, axis: int = 0) -> np.ndarray:
    """Four closed-loop poles, 1/s, the slowest first. Table of section 3.3."""
    values = np.linalg.eigvals(system_matrix(law, axis))
    return values[np.argsort(-values.real)]


def estimation_response(law: RCAF, frequency: np.ndarray | float, axis: int = 0) -> np.ndarray:
    """d_til / d at angular frequencies in rad/s: complex, shaped like `frequency`. Section 3.4."""
    return _response(system_matrix(law, axis), frequency)[..., 3]


def tracking_response(law: RCAF, frequency: np.ndarray | float, axis: int = 0) -> np.ndarray:
    """e / d, m per m/s^2, at angular frequencies in rad/s: complex, shaped like `frequency`. Section 3.4."""
    return _response(system_matrix(law, axis), frequency)[..., 0]


def observer_frequency(law: RCAF, axis: int = 0) -> float:
    """Natural frequency sqrt(gamma gamma_eps rho) of the estimator, rad/s. Sections 3.1, 3.3."""
    return float(np.sqrt(gains(law, axis).b2))


def observer_damping(law: RCAF, axis: int = 0) -> float:
    """Damping ratio a1 / (2 w_o) of the estimator; infinite for RAFC, which has none. Sections 3.1, 3.3."""
    frequency = observer_frequency(law, axis)
    return gains(law, axis).pole / (2 * frequency) if frequency > 0 else float("inf")


def crossing_frequency(law: RCAF, axis: int = 0) -> float:
    """Lowest frequency, rad/s, above which the estimate is worse than none: |d_til / d| = 1. Section 3.4.

    Near sqrt(gamma gamma_eps rho / 2) when the composite branch dominates.
    """
    matrix = system_matrix(law, axis)

    def worse(frequency: float) -> bool:
        return bool(np.abs(_response(matrix, frequency)[3]) > 1)

    return first_crossing(worse, np.geomspace(1e-3, 1e5, 4001))


def ramp_error(law: RCAF, axis: int = 0) -> tuple[float, float]:
    """Steady e (m) and d_til (m/s^2) per unit of d_dot, in absolute value. Section 3.4.

    For the composite law nearly a1 / [gamma rho (p12 a1 + stiffness gamma_eps)] and a1 / (gamma gamma_eps rho).
    """
    steady = np.linalg.solve(system_matrix(law, axis), np.array([0.0, 0.0, 0.0, 1.0]))
    return float(abs(steady[0])), float(abs(steady[3]))


def peak_gains(law: RCAF, axis: int = 0) -> tuple[float, float]:
    """L1 gains: sup|e| (m) and sup|d_til| (m/s^2) per unit of sup|d_dot|, from rest. Section 3.4.

    Raises:
        BadInput: the linearised law is unstable.
    """
    values, vectors = np.linalg.eig(system_matrix(law, axis))
    growth = np.real(values)
    if not growth.max() < 0:
        raise BadInput("law", "be stable in small signal", f"of rightmost pole {growth.max():.3g} 1/s")
    modes = vectors * np.linalg.solve(vectors, np.array([0.0, 0.0, 0.0, 1.0]))
    end = 40 / np.abs(growth).min()
    times = np.concatenate([[0.0], np.geomspace(1e-4 / abs(values).max(), end, 200_000)])
    impulse = np.abs((np.exp(np.outer(times, values)) @ modes[[0, 3]].T).real)
    e, d_til = np.trapezoid(impulse, times, axis=0)
    return float(e), float(d_til)


def transient_bias(law: RCAF, axis: int = 0) -> float:
    """d_hat - d per unit of s while an error transient lasts: -a1 / gamma_eps, 1/s per unit of s. Section 3.5."""
    g = gains(law, axis)
    return -g.pole / g.composite if g.composite > 0 else -float("inf")


def sampled_matrix(law: RCAF, dt: float, rule: str = "euler", axis: int = 0) -> np.ndarray:
    """Jacobian (4 x 4) of one step on (e, e_dot, eps, d_til): y, r and u held over dt seconds. Section 3.6.

    Args:
        law: the law.
        dt: sampling time, s.
        rule: `euler`, one explicit step of the law's state per step, or `exact`, its flow followed exactly, which
            is the limit of many substeps.
        axis: which axis.
    """
    if rule not in RULES:
        raise BadInput("rule", f"be one of {', '.join(RULES)}", rule)
    return _step_matrix(gains(law, axis), dt, rule)


def largest_sampling_time(law: RCAF, rule: str = "euler", axis: int = 0) -> float:
    """Sampling time, s, at which the spectral radius of the sampled Jacobian first reaches 1. Section 3.6."""
    g = gains(law, axis)

    def unstable(dt: float) -> bool:
        return bool(np.abs(np.linalg.eigvals(_step_matrix(g, dt, rule))).max() > 1)

    return first_crossing(unstable, np.geomspace(1e-6, 1e2, 2001))


def first_crossing(beyond: Callable[[float], bool], grid: np.ndarray, halvings: int = 60) -> float:
    """Where `beyond` first turns true along a rising grid; 0 if from the start, infinite if nowhere.

    Args:
        beyond: of a value.
        grid: rising.
        halvings: of the step of the grid in which it turns; 60 come down to rounding.
    """
    first = next((i for i, point in enumerate(grid) if beyond(point)), None)
    if first is None:
        return float("inf")
    if first == 0:
        return 0.0
    low, high = grid[first - 1], grid[first]
    for _ in range(halvings):
        middle = 0.5 * (low + high)
        low, high = (low, middle) if beyond(middle) else (middle, high)
    return float(high)


def _step_matrix(g: Gains, dt: float, rule: str) -> np.ndarray:
    unit = np.eye(4)
    push = np.array([g.stiffness, g.damping, 0.0, -1.0])  # u = push . state
    sliding = np.array([g.p12, g.p22, 0.0, 0.0])  # s = sliding . state
    # The law's own flow between two steps: (x_hat_dot - measured x_dot, d_hat), driven by s and u.
    flow = np.zeros((4, 4))
    flow[0] = -g.pole, 1.0, 0.0, 1.0
    flow[1] = -g.b2, 0.0, -g.adaptation, 0.0
    across = unit + dt * flow if rule == "euler" else expm(dt * flow)
    learned = across[:2] @ np.stack([unit[2], unit[3], sliding, push])
    rate = unit[1] - dt * push  # e_dot one step later; x_dot moves by dt u
    return np.stack([unit[0] + dt * unit[1] - dt**2 / 2 * push, rate, learned[0] - dt * push, learned[1]])


def _response(matrix: np.ndarray, frequency: np.ndarray | float) -> np.ndarray:
    """(e, e_dot, eps, d_til) / d."""
    p = 1j * np.asarray(frequency, dtype=float)[..., None, None]
    drive = np.array([[0.0], [0.0], [0.0], [-1.0]])
    return (p * np.linalg.solve(p * np.eye(4) - matrix, drive + 0 * p))[..., 0]


def _of_axis(value, axis: int, rank: int) -> np.ndarray:
    array = np.asarray(value, dtype=float)
    return array[axis] if array.ndim > rank else array


def _number(value, axis: int) -> float:
    return float(_of_axis(value, axis, 0))
