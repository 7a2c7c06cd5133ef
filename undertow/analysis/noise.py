"""Effect of white measurement noise on a sampled controller: stationary covariances, section 3.7 of the theory page.

Per axis, on x_ddot = u + d with an exact model and actuators that obey at once, y = (e, e_dot, eps, z) of the truth
obeys y+ = A y + B n. d_hat = z - c eps, where c is the gain that drift adds (section 3.8), zero at first. Errors n of
position and velocity are new at every step; the law takes y - S n for the truth. Both laws have this form.
"""

import functools
from typing import NamedTuple

import numpy as np

from undertow.analysis.small_signal import gains
from undertow.controllers.composite_law import RCAF
from undertow.controllers.robust.robust_law import RobustRCAF
from undertow.core.arrays import as_array
from undertow.core.errors import BadInput

_SEEN = np.array([[1.0, 0.0], [0.0, 1.0], [0.0, 1.0], [0.0, 0.0]])  # S


class Steps(NamedTuple):
    """What one axis of a law does in one step, in small signal."""

    dt: float  # s
    push: np.ndarray  # (4,): u = push y
    filtered: np.ndarray  # (4,): s = filtered y
    of_rates: float  # correction of x_hat_dot per eps
    of_estimate: float  # correction of d_hat per eps, 1/s
    of_tracking: float  # correction of d_hat per s, 1/s
    basis_norm_squared: float  # rho = |xi(0)|^2


class Deviations(NamedTuple):
    """Stationary standard deviations."""

    error: float  # e, m
    modelling_error: float  # eps as the law sees it, m/s
    estimate: float  # d_hat, m/s^2
    input: float  # u, m/s^2


@functools.singledispatch
def steps(law: RCAF | RobustRCAF, dt: float, axis: int = 0) -> Steps:
    """One step of one axis, sampled every dt seconds; each class of laws registers its own.

    Raises:
        BadInput: the paper's law with several steps per step, or with a `sign` switch; a law of another class.
    """
    raise BadInput("law", "be the paper's or the robust one", f"a {type(law).__name__}")


@steps.register
def _paper(law: RCAF, dt: float, axis: int = 0) -> Steps:
    if (law.method, law.substeps) != ("euler", 1):
        raise BadInput("method", "be euler with one step per step", f"{law.method} with {law.substeps}")
    g = gains(law, axis)
    return Steps(
        dt=dt,
        push=np.array([g.stiffness, g.damping, 0.0, -1.0]),
        filtered=np.array([g.p12, g.p22, 0.0, 0.0]),
        of_rates=dt * g.pole,
        of_estimate=dt * g.b2,
        of_tracking=dt * g.adaptation,
        basis_norm_squared=float(law.fuzzy.basis_norm_squared()),
    )


def step_matrices(one: Steps, gain: float = 0.0) -> tuple[np.ndarray, np.ndarray]:
    """A (4 x 4) and B (4 x 2) of one step of y, with a gain c in 1/s; columns of B per m and per m/s of error."""
    unit, dt = np.eye(4), one.dt
    push = one.push + gain * unit[2]
    seen = np.stack(
        [
            unit[0] + dt * unit[1] - dt**2 / 2 * push,
            unit[1] - dt * push,
            (1 - one.of_rates - dt * gain) * unit[2] + dt * unit[3],
            unit[3] - one.of_estimate * unit[2] - one.of_tracking * one.filtered,
        ]
    )
    # What the plant carries on from one step to the next it carries on without the errors.
    kept = _SEEN + np.outer(unit[0], [0.0, dt])
    return seen, kept - seen @ _SEEN


def deviations(
    law: RCAF | RobustRCAF, dt: float, position: float = 0.0, velocity: float = 0.01, gain: float = 0.0, axis: int = 0
) -> Deviations:
    """Standard deviations under white noise, from the discrete Lyapunov equation P = A P A^T + B N B^T.

    Args:
        law: the paper's or the robust one.
        dt: sampling time, s.
        position, velocity: standard deviations of the noise, m and m/s.
        gain: c of section 3.8, 1/s.
        axis: which axis.

    Raises:
        BadInput: the sampled law is unstable.
    """
    from scipy.linalg import solve_discrete_lyapunov  # takes longer to import than all a run needs

    one = steps(law, dt, axis)
    matrix, entry = step_matrices(one, gain)
    radius = float(np.abs(np.linalg.eigvals(matrix)).max())
    if not radius < 1:
        raise BadInput("law", f"be stable when sampled every {dt:g} s", f"of spectral radius {radius:.4g}")
    noise = np.diag([position**2, velocity**2])
    spread = solve_discrete_lyapunov(matrix, entry @ noise @ entry.T)
    seen = spread + _SEEN @ noise @ _SEEN.T
    error, eps = np.eye(4)[0], np.eye(4)[2]
    estimate, push = np.eye(4)[3] - gain * eps, one.push + gain * eps
    of = lambda row, covariance: float(np.sqrt(row @ covariance @ row))
    return Deviations(of(error, spread), of(eps, seen), of(estimate, seen), of(push, seen))


def estimate_rule(law: RCAF | RobustRCAF, dt: float, axis: int = 0) -> float:
    """Std of d_hat per std of velocity noise, 1/s, by the rule b2 sqrt(dt / (2 a1)). Section 3.7.

    From continuous time without the tracking share: some 10 % low at 1 ms and Table 1, 20 % at 2 ms.
    """
    one = steps(law, dt, axis)
    return one.of_estimate / np.sqrt(2 * one.of_rates)


def input_rule(law: RCAF | RobustRCAF, dt: float, axis: int = 0) -> float:
    """Std of u per std of velocity noise, 1/s: damping and `estimate_rule` as if independent. Section 3.7."""
    return float(np.hypot(steps(law, dt, axis).push[1], estimate_rule(law, dt, axis)))


@steps.register
def _robust(law: RobustRCAF, dt: float, axis: int = 0) -> Steps:
    axes = len(law.model.coordinates.angles)
    at = lambda value, *shape: np.broadcast_to(np.asarray(value, dtype=float), (axes, *shape))[axis]
    filtered = np.append(at(law.lyapunov(), 2, 2)[:, 1], [0.0, 0.0])
    slope = at(law.robust_gain) / at(law.layer)
    of_rates, of_estimate = (float(at(value)) for value in law.estimator.gains(as_array(dt)))
    return Steps(
        dt=dt,
        push=np.append(at(law.feedback, 2), [0.0, -1.0]) + slope * filtered,
        filtered=filtered,
        of_rates=of_rates,
        of_estimate=of_estimate,
        of_tracking=of_estimate * float(at(law.tracking_share)),
        basis_norm_squared=float(law.estimator.fuzzy.basis_norm_squared()),
    )
