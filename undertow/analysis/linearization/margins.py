"""Robustness margins of the linearised loop: sampling, delay, lag and gain; its poles and its response to noise."""

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
import scipy  # its parts are loaded when they are used

from undertow.analysis.linearization.disturbance_profile import OperatingConditions
from undertow.analysis.linearization.equilibrium import Equilibrium, equilibrium
from undertow.analysis.linearization.linear_loop import LinearLoop, close_continuous, close_sampled
from undertow.analysis.linearization.minimal_realization import multipliers, visible
from undertow.analysis.small_signal import first_crossing
from undertow.core.errors import BadInput
from undertow.simulation.loop.closed_loop import ClosedLoop

# Inputs and signals of the controllable poles: no controller can stabilise degrees of freedom that no input moves.
_REACHED_BY, _SHOWN_BY = ("input", "noise"), ("error", "u")

_POINTS, _HALVINGS = 25, 12  # of a search: to a ten-thousandth of the value
_MANY_STEPS = 50  # of delay, from which on a step is a small share
_LEAST_TURN, _TURNS = 1e-4, 1000  # rad in a step; frequencies at which the open loop is computed
_FADING = 1 - 1e-9  # so that what rounding leaves of modes that nothing excites fades away
_STABLE = 1 + 1e-9  # a spectral radius of one, and rounding


class NoSlopes(BadInput):
    """The loop has no finite slopes where it rests."""


def closed(at: Equilibrium, dt: float, kind: str = "sampled", **between: float) -> LinearLoop:
    """The closed loop of a scenario's kind; see `close_sampled` for what may stand `between` law and plant.

    Raises:
        NoSlopes: they are not finite where it rests.
    """
    loop = close_sampled(at, dt, **between) if kind == "sampled" else close_continuous(at, dt)
    if not all(np.isfinite(part).all() for part in (loop.matrix, *loop.entries.values(), *loop.signals.values())):
        hint = (
            "`loop.dt` is too long for this plant, some number too large, or the slope of the law infinite where it "
            "rests, as that of sqrt(|e|)"
        )
        raise NoSlopes("", "", "the loop cannot be linearised: its slopes are not finite", hint=hint)
    return loop


def poles(loop: LinearLoop) -> np.ndarray:
    """Controllable closed-loop poles in 1/s (logarithms over dt), the slowest first."""
    values = multipliers(loop, _REACHED_BY, _SHOWN_BY).astype(complex)
    rates = np.log(np.where(values == 0, 1e-300, values)) / loop.dt
    return rates[np.argsort(-rates.real, kind="stable")]


def spectral_radius(loop: LinearLoop) -> float:
    """Spectral radius of the controllable closed-loop poles over one control step; stable below 1."""
    return float(np.abs(multipliers(loop, _REACHED_BY, _SHOWN_BY)).max(initial=0.0))


def fastest_growing_error(loop: LinearLoop, radius: float) -> tuple[int, complex]:
    """The output whose error has most of the mode that grows fastest or decays slowest, and the pole of that, 1/s.

    Args:
        loop: see there.
        radius: its spectral radius.
    """
    values, modes = np.linalg.eig(loop.matrix)
    mode = int(np.argmin(np.abs(np.abs(values) - radius)))
    errors = np.abs(loop.signals["error"] @ modes[:, mode])
    return int(np.argmax(errors)), complex(np.log(complex(values[mode])) / loop.dt)


def largest_delay(at: Equilibrium, dt: float, most: float) -> float:
    """Delay, s, from the law to the actuators at which the sampled loop becomes unstable; infinite beyond `most`.

    A long one is found by the phase of the open loop, to a fraction of a step, because a loop with a delay of hundreds
    of steps has thousands of states.
    """
    if spectral_radius(close_sampled(at, dt)) > _STABLE:
        return 0.0
    by_phase = _delay_by_phase(close_sampled(at, dt, delay=dt), _inputs(at))
    if by_phase > _MANY_STEPS * dt:
        return by_phase if by_phase <= most else float("inf")
    return _largest(lambda delay: close_sampled(at, dt, delay=delay), dt / 50, min(most, 2 * _MANY_STEPS * dt))


def _inputs(at: Equilibrium) -> int:
    return at.local.slopes["plant"]["u"].shape[1]


def _delay_by_phase(late: LinearLoop, inputs: int) -> float:
    """The same in whole and broken numbers of steps, from a loop whose inputs act one step late, s; infinite for none.

    With L from the acting to the commanded input, a delay of k steps leaves a motion with frequency w that neither
    grows nor decays where an eigenvalue of L(e^(j w dt)) is e^(j w dt k).
    """
    count = len(late.matrix) - 2 * inputs  # two slots of inputs that wait, of which the newer one acts
    state, slot = slice(0, count), slice(count, count + inputs)
    a, b, c = late.matrix[state, state], late.matrix[state, slot], late.matrix[slot, state]
    turns = np.geomspace(_LEAST_TURN, np.pi, _TURNS)
    z = np.exp(1j * turns)[:, None, None]
    eigenvalues = np.linalg.eigvals(c @ np.linalg.solve(z * np.eye(count) - a, np.broadcast_to(b, (_TURNS, *b.shape))))
    eigenvalues = np.take_along_axis(eigenvalues, np.argsort(-np.abs(eigenvalues), axis=1), axis=1)
    size = np.abs(eigenvalues)
    crosses = (size[1:] >= 1) != (size[:-1] >= 1)
    steps = np.mod(np.angle(eigenvalues), 2 * np.pi) / turns[:, None]
    share = ((1 - size[:-1]) / np.where(crosses, size[1:] - size[:-1], 1.0))[crosses]
    between = (1 - share) * steps[:-1][crosses] + share * steps[1:][crosses]
    return float(late.dt * between.min(initial=np.inf))


def largest_lag(at: Equilibrium, dt: float, most: float) -> float:
    """Further first-order lag of the actuators, s, at which it becomes unstable; infinite beyond `most`."""
    return _largest(lambda lag: close_sampled(at, dt, lag=lag), dt / 50, most)


def gain_range(at: Equilibrium, dt: float, most: float = 100.0) -> tuple[float, float]:
    """Factors on what the input does, below and above which the sampled loop is unstable: 0 and infinite where none
    from 1 / most to most is; 1 and 1 where it is unstable as it is."""
    above = _largest(lambda gain: close_sampled(at, dt, gain=gain), 1.0, most)
    below = _largest(lambda inverse: close_sampled(at, dt, gain=1 / inverse), 1.0, most)
    return 1 / max(below, 1.0), max(above, 1.0)


def largest_sampling_time(at: Equilibrium, dt: float, most: float) -> float:
    """Sampling time, s, at which the loop with these gains becomes unstable; infinite beyond `most`.

    Where a loop rests does not depend on its sampling time. The search starts well below dt, the present one.
    """
    resampled = lambda step: at._replace(local=at.parts.differentiate(at.at, step))
    return _largest(lambda step: close_sampled(resampled(step), step), dt / 20, most)


def noise_gain(loop: LinearLoop, signal: str, deviations: np.ndarray) -> np.ndarray:
    """Standard deviations of a signal under white noise on the measurement, new at every step.

    From the discrete Lyapunov equation P = A P A^T + B R B^T. Infinite where the loop is unstable.

    Args:
        loop: closed and sampled.
        signal: name.
        deviations: standard deviations of the noise on positions, then on velocities.
    """
    small = visible(loop, ("noise",), (signal,))
    entry = small.entries["noise"] * deviations
    direct = loop.direct[signal]["noise"] * deviations
    if np.abs(multipliers(loop, ("noise",), (signal,))).max(initial=0.0) >= 1:
        return np.full(len(loop.signals[signal]), np.inf)
    covariance = scipy.linalg.solve_discrete_lyapunov(_FADING * small.matrix, entry @ entry.T)
    output = small.signals[signal]
    return np.sqrt(np.einsum("ij,jk,ik->i", output, covariance, output) + (direct**2).sum(axis=1))


def response(loop: LinearLoop, signal: str, frequency: np.ndarray) -> np.ndarray:
    """Complex answer of a signal to the load at angular frequencies (rad/s): shape (frequencies, axes, axes)."""
    small = visible(loop, ("load",), (signal,))
    turning = np.exp(1j * np.asarray(frequency, dtype=float) * loop.dt)[:, None, None]
    inner = np.linalg.solve(turning * np.eye(len(small.matrix)) - small.matrix, small.entries["load"] + 0j)
    return small.signals[signal] @ inner + loop.direct[signal]["load"]


def equilibria(
    loop: ClosedLoop, dt: float, position: Any, points: Sequence[OperatingConditions], near: Sequence[Equilibrium] = ()
) -> list[Equilibrium]:
    """The closed loop at rest at each of some operating points, found or not.

    Args:
        loop: the five roles.
        dt: sampling time, s.
        position: of the reference, m and rad.
        points: what acts at each.
        near: with another law of the same kind; see `equilibrium`.
    """
    begin = near or [None] * len(points)
    return [
        equilibrium(loop, dt, position, conditions.load, conditions.flow, at)
        for conditions, at in zip(points, begin, strict=True)
    ]


def certify(
    loop: ClosedLoop, dt: float, position: Any, points: Sequence[OperatingConditions], near: Sequence[Equilibrium] = ()
) -> list[float]:
    """Spectral radius of the closed loop at rest at each of some operating points; below 1 each is stable.

    Loads that no input holds are left out; where none is held, the radius is infinite.

    For the arguments see `equilibria`.
    """
    points_at_rest = equilibria(loop, dt, position, points, near)
    return [spectral_radius(closed(at, dt)) for at in points_at_rest if at.found] or [float("inf")]


def _largest(closed_at: Callable[[float], LinearLoop], least: float, most: float) -> float:
    beyond = lambda value: spectral_radius(closed_at(value)) > _STABLE
    return first_crossing(beyond, np.geomspace(least, most, _POINTS), _HALVINGS)
