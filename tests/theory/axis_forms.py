"""One axis of a law in closed form, as far as only tests need it: sections 3.4 to 3.9 of the theory.

Per axis, on x_ddot = u + d with an exact model. Under noise y = (e, e_dot, eps, z) of the truth obeys y+ = A y + B n.
d_hat = z - c eps, where c is the gain that drift adds (section 3.8), zero at first. Errors n of position and velocity
are new at every step; the law takes y - S n for the truth. Both laws have this form.
"""

import functools
from typing import NamedTuple

import numpy as np
from scipy.linalg import expm, solve_discrete_lyapunov

from undertow.analysis import drift, motor_loop
from undertow.analysis.small_signal import Gains, first_crossing, gains, of_axis, system_matrix
from undertow.control.controllers.composite_law import RCAF
from undertow.control.controllers.robust.robust_law import RobustRCAF
from undertow.core.errors import BadInput
from undertow.physics.thrusters.motor import DCMotor

RULES = ("euler", "exact")  # how the law's own state is advanced over one sampling time


def tracking_response(law: RCAF, frequency: np.ndarray | float) -> np.ndarray:
    """e / d, m per m/s^2, at angular frequencies in rad/s: complex, shaped like `frequency`. Section 3.4."""
    p = 1j * np.asarray(frequency, dtype=float)[..., None, None]
    drive = np.array([[0.0], [0.0], [0.0], [-1.0]])
    return (p * np.linalg.solve(p * np.eye(4) - system_matrix(law), drive + 0 * p))[..., 0, 0]


def peak_gains(law: RCAF) -> tuple[float, float]:
    """L1 gains: sup|e| (m) and sup|d_til| (m/s^2) per unit of sup|d_dot|, from rest, of a stable law. Section 3.4."""
    values, vectors = np.linalg.eig(system_matrix(law))
    growth = np.real(values)
    assert growth.max() < 0
    modes = vectors * np.linalg.solve(vectors, np.array([0.0, 0.0, 0.0, 1.0]))
    end = 40 / np.abs(growth).min()
    times = np.concatenate([[0.0], np.geomspace(1e-4 / abs(values).max(), end, 20_000)])
    impulse = np.abs((np.exp(np.outer(times, values)) @ modes[[0, 3]].T).real)
    e, d_til = np.trapezoid(impulse, times, axis=0)
    return float(e), float(d_til)


def transient_bias(law: RCAF) -> float:
    """d_hat - d per unit of s while an error transient lasts: -a1 / gamma_eps, 1/s per unit of s. Section 3.5."""
    g = gains(law)
    return -g.pole / g.composite


def sampled_matrix(law: RCAF, dt: float, rule: str = "euler") -> np.ndarray:
    """Jacobian (4 x 4) of one step on (e, e_dot, eps, d_til): y, r and u held over dt seconds. Section 3.6.

    Args:
        law: the law.
        dt: sampling time, s.
        rule: `euler`, one explicit step of the law's state per step, or `exact`, its flow followed exactly, which
            is the limit of many substeps.
    """
    return _step_matrix(gains(law), dt, rule)


def largest_sampling_time(law: RCAF, rule: str = "euler") -> float:
    """Sampling time, s, at which the spectral radius of the sampled Jacobian first reaches 1. Section 3.6."""
    g = gains(law)
    unstable = lambda dt: bool(np.abs(np.linalg.eigvals(_step_matrix(g, dt, rule))).max() > 1)
    return first_crossing(unstable, np.geomspace(1e-6, 1e2, 2001))


def _step_matrix(g: Gains, dt: float, rule: str) -> np.ndarray:
    unit = np.eye(4)
    push = np.array([g.stiffness, g.damping, 0.0, -1.0])  # u = push . state
    sliding = np.array([g.p12, g.p22, 0.0, 0.0])  # s = sliding . state
    # The law's own flow between two steps: (x_hat_dot - measured x_dot, d_hat), driven by s and u.
    flow = np.zeros((4, 4))
    flow[0] = -g.pole, 1.0, 0.0, 1.0
    flow[1] = -g.b2, 0.0, -g.adaptation, 0.0
    across = {"euler": unit + dt * flow, "exact": expm(dt * flow)}[rule]
    learned = across[:2] @ np.stack([unit[2], unit[3], sliding, push])
    rate = unit[1] - dt * push  # e_dot one step later; x_dot moves by dt u
    return np.stack([unit[0] + dt * unit[1] - dt**2 / 2 * push, rate, learned[0] - dt * push, learned[1]])


_SEEN = np.array([[1.0, 0.0], [0.0, 1.0], [0.0, 1.0], [0.0, 0.0]])  # S


class Steps(NamedTuple):
    """What one axis of a law does in one step, in small signal."""

    dt: float  # s
    push: np.ndarray  # (4,): u = push y
    filtered: np.ndarray  # (4,): s = filtered y
    of_rates: float  # correction of x_hat_dot per eps
    of_estimate: float  # correction of d_hat per eps, 1/s
    of_tracking: float  # correction of d_hat per s, 1/s


class Deviations(NamedTuple):
    """Stationary standard deviations."""

    error: float  # e, m
    modelling_error: float  # eps as the law sees it, m/s
    estimate: float  # d_hat, m/s^2
    input: float  # u, m/s^2


@functools.singledispatch
def steps(law: RCAF | RobustRCAF, dt: float) -> Steps:
    """One step of the first axis, sampled every dt seconds."""
    raise TypeError(law)


@steps.register
def _paper(law: RCAF, dt: float) -> Steps:
    g = gains(law)
    of_rates, of_estimate = drift.corrections(law, dt)
    push = np.array([g.stiffness, g.damping, 0.0, -1.0])
    return Steps(dt, push, np.array([g.p12, g.p22, 0.0, 0.0]), of_rates, of_estimate, dt * g.adaptation)


@steps.register
def _robust(law: RobustRCAF, dt: float) -> Steps:
    at = lambda value, *shape: of_axis(law, value, 0, *shape)
    filtered = np.append(at(law.lyapunov(), 2, 2)[:, 1], [0.0, 0.0])
    push = np.append(at(law.feedback, 2), [0.0, -1.0]) + at(law.robust_gain) / at(law.layer) * filtered
    of_rates, of_estimate = drift.corrections(law, dt)
    return Steps(dt, push, filtered, of_rates, of_estimate, of_estimate * float(at(law.tracking_share)))


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
    law: RCAF | RobustRCAF, dt: float, position: float = 0.0, velocity: float = 0.01, gain: float = 0.0
) -> Deviations:
    """Standard deviations under white noise, from the discrete Lyapunov equation P = A P A^T + B N B^T. Section 3.7.

    Args:
        law: the paper's or the robust one.
        dt: sampling time, s.
        position, velocity: standard deviations of the noise, m and m/s.
        gain: c of section 3.8, 1/s.

    Raises:
        BadInput: the sampled law is unstable.
    """
    one = steps(law, dt)
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


def estimate_rule(law: RCAF | RobustRCAF, dt: float) -> float:
    """Std of d_hat per std of velocity noise, 1/s, by the rule b2 sqrt(dt / (2 a1)). Section 3.7.

    From continuous time without the tracking share: some 10 % low at 1 ms and Table 1, 20 % at 2 ms.
    """
    of_rates, of_estimate = drift.corrections(law, dt)
    return of_estimate / np.sqrt(2 * of_rates)


def input_rule(law: RCAF | RobustRCAF, dt: float) -> float:
    """Std of u per std of velocity noise, 1/s: damping and `estimate_rule` as if independent. Section 3.7."""
    return float(np.hypot(steps(law, dt).push[1], estimate_rule(law, dt)))


def is_certified(law: RCAF | RobustRCAF, dt: float) -> bool:
    """Whether no drift can make the estimator unstable at this sampling time. Section 3.8."""
    return drift.gain_bound(law) < drift.largest_gain(law, dt)


def drift_rate(law: RCAF | RobustRCAF, dt: float, mean_square: float) -> float:
    """c_dot = gamma gamma_eps |xi'(0)|^2 mean(eps^2), 1/s^2, of a mean square in (m/s)^2. Section 3.8."""
    _, of_estimate = drift.corrections(law, dt)
    squared_slope = float((drift.basis_slope(law.fuzzy) ** 2).sum())
    return of_estimate / dt / float(law.fuzzy.basis_norm_squared()) * squared_slope * mean_square


def noise_square(law: RCAF | RobustRCAF, dt: float, velocity: float, gain: float = 0.0) -> float:
    """Mean square of eps, (m/s)^2, under white noise of a standard deviation `velocity`, with a gain c in 1/s.

    Of the estimator alone: eps = -(q - 1)^2 / ((q - 1)^2 + p (q - 1) + r) n, q the shift by one step.
    """
    of_rates, of_estimate = drift.corrections(law, dt)
    p, r = of_rates + dt * gain, of_estimate * dt
    return velocity**2 * 2 * (2 * p - r) / ((p - r) * (4 - 2 * p + r))


def motor_lag(motor: DCMotor, speed: float) -> tuple[float, float]:
    """Gain kappa and lag tau (s) of a / a_c = kappa / (tau p + 1) about a propeller speed (rad/s), L = 0.

    g0 = 2 k_3 c_q |speed|, kappa = g0 / (k_2 + g0), tau = k_1 / (k_2 + g0). Section 3.9.
    """
    slope = 2 * float(motor.k3 * motor.torque_coefficient) * abs(speed)
    total = float(motor.k2) + slope
    return slope / total, float(motor.k1) / total


def critical_lag(law: RCAF) -> float:
    """Actuator lag, s, beyond which the whole loop is unstable; infinite if none below 100 s is. Section 3.9."""
    matrix = motor_loop.lag_matrix(law, 1.0)  # of which a lag divides the actuator's row, the last one
    unstable = lambda lag: motor_loop.rightmost(np.vstack([matrix[:-1], matrix[-1:] / lag])).real > 0
    return first_crossing(unstable, np.geomspace(1e-6, 1e2, 401))


def critical_observer_lag(law: RCAF) -> float:
    """Unity-gain lag, s, that the observer loop alone tolerates: a1 / (b2 - a1^2), or infinite. Section 3.9.

    Routh's condition for lag p^3 + (1 + a1 lag) p^2 + a1 p + b2, without the feedback and the robust term.
    """
    g = gains(law)
    return g.pole / (g.b2 - g.pole**2) if g.b2 > g.pole**2 else float("inf")
