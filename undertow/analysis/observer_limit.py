"""How slow an observer of velocity may be for a law that estimates the uncertainty: the limit of stability.

One axis in continuous time, with actuators that follow at once: v_dot = u + d, the observer of
`undertow.control.navigation.pose_only`, and the law with its estimator linearised at zero,

    u = - d_hat - k_1 x_hat - k_2 v_hat ,  v_bar_dot = - alpha eps + u + d_hat ,  d_hat_dot = - w_d^2 (eps + mu s)

with eps = v_bar - v_hat and s = - p_1 x_hat - p_2 v_hat. Error of the observer enters through eps, e and e_dot.
"""

from typing import NamedTuple

import numpy as np
from jaxtyping import Float

from undertow.analysis.small_signal import gains
from undertow.control.controllers.composite_law import RCAF
from undertow.core import checks

_GRID, _ROUNDS = 400, 40
_SLOWEST, _FASTEST = 0.02, 200.0  # over the largest rate of the law


class LinearLaw(NamedTuple):
    """A law at small errors.

    Attributes:
        pole: alpha, 1/s.
        frequency: w_d of its estimator, rad/s.
        feedback: k_1 and k_2, those of the robust term included, 1/s^2 and 1/s.
        share: mu p_1 and mu p_2, of the tracking error in the adaptation, 1 and s; zero for a pure observer.
    """

    pole: float
    frequency: float
    feedback: tuple[float, float]
    share: tuple[float, float] = (0.0, 0.0)


def papers_law(law: RCAF, axis: int = 0) -> LinearLaw:
    """The paper's law at small errors, one axis. Section 3.1 of the theory.

    Raises:
        BadInput: a `sign` switch has no slope, or gamma_eps is 0.
    """
    g = gains(law, axis)
    checks.positive("composite", g.composite)
    share = (g.p12 / g.composite, g.p22 / g.composite)
    return LinearLaw(g.pole, g.b2**0.5, (g.stiffness, g.damping), share)


def loop_poles(law: LinearLaw, bandwidth: float, order: int = 3) -> Float[np.ndarray, " states"]:
    """Poles of the loop of plant, observer and law, 1/s.

    Args:
        law: at small errors.
        bandwidth: poles of the observer, rad/s.
        order: of the observer, 2 or 3.
    """
    (k1, k2), (m1, m2), w = law.feedback, law.share, bandwidth
    gains = {2: (2 * w, w**2, 0.0), 3: (3 * w, 3 * w**2, w**3)}[order]
    x, v, x_hat, v_hat, a_hat, v_bar, d_hat = np.eye(7)
    u = -d_hat - k1 * x_hat - k2 * v_hat
    eps, position_error = v_bar - v_hat, x - x_hat
    rows = [
        v,
        u,
        v_hat + gains[0] * position_error,
        (a_hat if order == 3 else 0 * a_hat) + gains[1] * position_error,
        gains[2] * position_error,
        -law.pole * eps + u + d_hat,
        -(law.frequency**2) * (eps - m1 * x_hat - m2 * v_hat),
    ]
    matrix = np.stack(rows)
    states = [i for i in range(7) if order == 3 or i != 4]
    return np.asarray(np.linalg.eigvals(matrix[np.ix_(states, states)]), dtype=complex)


def slowest_observer(law: LinearLaw, order: int = 3) -> float:
    """Bandwidth, rad/s, from which on all faster observers give a stable loop."""
    stable = lambda w: bool(np.real(loop_poles(law, w, order)).max() < 0)
    largest = max(law.pole, law.frequency, law.feedback[1], law.feedback[0] ** 0.5)
    grid = np.geomspace(_SLOWEST, _FASTEST, _GRID) * largest
    unstable = [i for i, w in enumerate(grid) if not stable(w)]
    if not unstable:
        return 0.0
    low, high = grid[unstable[-1]], grid[min(unstable[-1] + 1, _GRID - 1)]
    for _ in range(_ROUNDS):
        middle = (low + high) / 2
        low, high = (low, middle) if stable(middle) else (middle, high)
    return float(high)
