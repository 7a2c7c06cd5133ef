"""Small-signal model of the controller: poles, frequency responses and limits in closed form.

The basis functions sum to one and eps stays small, so the fuzzy estimate behaves as one integrator with the gain
rho = |xi(0)|^2. Per axis, on x_ddot = u + d with an exact model and actuator, this leaves four linear states
(e, e_dot, eps, d_til), d_til = d_hat - d, driven by d_dot: sections 3.1 to 3.4 of the theory page. Everything here
is a plain number of one axis of a law, in SI units.
"""

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np

from undertow.control.controllers.composite_law import RCAF
from undertow.core.contracts import AbstractController
from undertow.core.errors import BadInput


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
    at = lambda value, *shape: of_axis(law, value, axis, *shape)
    feedback, lyapunov = at(law.feedback, 2), at(law.lyapunov(), 2, 2)
    p12, p22 = lyapunov[0, 1], lyapunov[1, 1]
    slope = at(law.robust_gain) / at(law.layer)
    model = law.identification
    return Gains(
        stiffness=float(feedback[0] + slope * p12),
        damping=float(feedback[1] + slope * p22),
        p12=float(p12),
        p22=float(p22),
        pole=float(at(model.pole) + at(model.compensation_gain) / at(model.compensation_layer)),
        adaptation=float(at(law.adaptation)) * float(law.fuzzy.basis_norm_squared()),
        composite=float(at(law.composite)),
    )


def of_axis(law: AbstractController, value: Any, axis: int, *shape: int) -> np.ndarray:
    """What a parameter of a law is for one axis, whether it was given for each or for all; (*shape,)."""
    return np.broadcast_to(np.asarray(value, dtype=float), (len(law.model.coordinates.angles), *shape))[axis]


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


def _response(matrix: np.ndarray, frequency: np.ndarray | float) -> np.ndarray:
    """(e, e_dot, eps, d_til) / d."""
    p = 1j * np.asarray(frequency, dtype=float)[..., None, None]
    drive = np.array([[0.0], [0.0], [0.0], [-1.0]])
    return (p * np.linalg.solve(p * np.eye(4) - matrix, drive + 0 * p))[..., 0]
