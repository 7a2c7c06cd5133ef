"""Rules for bandwidths: the least tracking error within stated stability margins, with a cost on chattering.

One axis, x_ddot = f + d with f behind a first-order actuator, sampled, with noise on the measured velocity. A law is
two transfer functions from position and velocity to its input. The rule tries a grid of bandwidths and takes the one
of least cost E = rms(e) / 0.05 + (mean step of the input between sampling times, as a share of its limit) / 0.02 among
those that keep every margin of `MARGINS`; where none keeps them all, the slowest. Noise makes such steps, and the dead
zone of an actuator without lag.
Masses enter through the authority of the actuators only. Frequencies are those of the sampled loop; the actuator is
assumed continuous. The rule assumes damping 1, and a tenth for the integral of a PID.
"""

import functools
from collections.abc import Callable, Sequence
from typing import NamedTuple

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from undertow.control.controllers.options import DesignConditions
from undertow.core import checks
from undertow.core.actuator_model import AbstractActuatorModel
from undertow.core.arrays import as_array, in_numbers
from undertow.core.contracts import Model
from undertow.core.kept_programs import kept_program, kept_values
from undertow.core.numerics.linear_algebra import matvec

# Largest sensitivity |1 / (1 + L)| allowed with a factor on the nominal lag, an additional lag of the actuator and an
# unknown delay, both in shares of `Axis.unknown_delay`.
MARGINS = (
    # lag factor, added lag, added delay, largest sensitivity
    (1.0, 0.0, 0.0, 2.5),
    (2.0, 0.0, 0.75, 10.0),
    (1 / 3, 0.0, 0.0, 5.0),
    (3.0, 0.0, 0.0, 15.0),
    (1.0, 0.0, 1.0, 5.0),
    (1.0, 0.5, 0.75, 5.0),
)
UNKNOWN_LAG = 1.5  # share of the unknown delay; assumed for an actuator of unknown lag
# What sensors, link and drives may take beyond what is known: they are made for the rate of the loop, up to a point.
_UNKNOWN_SAMPLES, _UNKNOWN_TIME = 4.0, 0.02  # sampling times; s

# An error of so many metres or radians costs as much as an input that moves by this share of its limit at each step.
_ERROR_SCALE, _STEP_SCALE = 0.05, 0.02

_FASTEST = 0.35  # share of the sampling rate; faster loops are dominated by sampling
_TRACKING_SHARES = (0.25, 0.35, 0.5, 0.75, 1.0, 1.5, 2.0, 3.0)  # tracking bandwidth over the estimator's
_ACTUATOR_SHARES = (0.0, 1.5, 3.0)  # bandwidth of the actuator loop over those two
_SLOWEST, _CANDIDATES, _FREQUENCIES = 0.02, 32, 100
# With a given bandwidth: range of tracking bandwidths, and bandwidth of the actuator loop, as shares of it.
_BESIDE, _ACTUATORS_FASTER = (0.25, 0.5), 3.0
_SWELL = 1.0  # rad/s
_AT_ONCE = 32  # candidates whose margins are computed together
_UNLIMITED = 1e9  # N, or the unit of the force
_INTEGRATORS = 3  # of L: two of the plant, one of the estimator or the integral


class Axis(NamedTuple):
    """Data of one axis for the rule.

    Attributes:
        sampling_time: s.
        lag: nominal time constant of the actuators, s; None where it is unknown.
        max_bandwidth: largest bandwidth of the actuator loop, 1/s.
        delay: known delay that is not compensated, s.
        velocity_noise: standard deviation at each sampling time, m/s or rad/s.
        load_rate: random walk of the loads, m/s^2 per sqrt(s) or rad/s^2 per sqrt(s).
        authority: largest acceleration of the actuators, m/s^2 or rad/s^2; infinite without a limit.
        dead_zone: input below which the actuators give nothing, as a share of its limit.
    """

    sampling_time: float
    lag: float | None
    max_bandwidth: float
    delay: float
    velocity_noise: float
    load_rate: float
    authority: float
    dead_zone: float = 0.0

    @property
    def unknown_delay(self) -> float:
        """Delay against which the margins are kept, beyond what is known, s."""
        return min(_UNKNOWN_SAMPLES * self.sampling_time, _UNKNOWN_TIME)

    @property
    def response_time(self) -> float:
        """Response time of the axis to its input, s: one sampling time, the known delay and the nominal lag."""
        return self.sampling_time + self.delay + (self.lag or 0.0)


class Bandwidths(NamedTuple):
    """Bandwidths in rad/s and 1/s, the inner loop first."""

    actuators: float
    bandwidth: float
    tracking: float


class LoopTransfer(NamedTuple):
    """Transfer functions from position and velocity to the input: arrays (candidates, frequencies)."""

    of_position: np.ndarray
    of_velocity: np.ndarray


def axes_of(model: Model, conditions: DesignConditions) -> list[Axis]:
    """Data of each axis of a model for the rule.

    Args:
        model: of the controller, in the coordinates of the law.
        conditions: what the law is designed for.

    Raises:
        BadInput: a value is out of its range.
    """
    sampling_time, delay = conditions.sampling_time, conditions.delay
    velocity_noise, load_rate = conditions.velocity_noise, conditions.load_rate
    checks.positive("sampling_time", sampling_time, "s")
    checks.not_negative("delay", delay, "s")
    checks.not_negative("velocity_noise", velocity_noise, "m/s, rad/s")
    checks.positive("load_rate", load_rate)
    axes = len(model.coordinates.angles)
    checks.per_axis("velocity_noise", velocity_noise, axes)
    checks.per_axis("load_rate", load_rate, axes)
    with in_numbers():  # bandwidths are numbers even where a law is made inside a compiled function
        still = as_array(np.zeros(axes))
        lag, max_bandwidth, forces = _actuation(model, still, as_array(_FASTEST / sampling_time))
        dead_zone = float(model.actuators.dead_zone())
    lag, max_bandwidth = None if lag is None else float(lag), float(max_bandwidth)
    largest = np.asarray(forces)
    authority = np.where(np.isfinite(largest) & (largest > 0) & (largest < _UNLIMITED), largest, np.inf)
    per_axis = lambda value: np.broadcast_to(np.asarray(value, dtype=float), axes).tolist()
    rows = zip(per_axis(velocity_noise), per_axis(load_rate), authority.tolist(), strict=True)
    common = (float(sampling_time), lag, max_bandwidth, float(delay))
    return [Axis(*common, *row, dead_zone) for row in rows]


@kept_program
def _actuation(
    model: Model, still: Float[Array, " n"], fastest: Float[Array, ""]
) -> tuple[Array | None, Array, Float[Array, " n"]]:
    """Lag of the slowest actuator (s, None without one), their largest bandwidth (rad/s), and the largest forces."""
    actuators = model.actuators
    time_constants = actuators.time_constant()
    gain = jnp.abs(model.dynamics.gain(model.coordinates.measurement(still, still)))
    forces = matvec(gain, largest_forces(actuators, gain.shape[1]))
    return None if time_constants is None else jnp.max(time_constants), actuators.max_bandwidth(fastest), forces


def scalar_if_uniform(values: Sequence[float]):
    """One number where all axes have the same value."""
    return values[0] if len(set(values)) == 1 else as_array(list(values))


def largest_forces(actuators: AbstractActuatorModel, count: int) -> Float[Array, " m"]:
    """Largest steady force of each of `count` actuators in its stronger direction; very large without a limit."""
    held = actuators.quasi_static()
    low, high = held.range(held.init(), jnp.ones(()))
    return jnp.broadcast_to(jnp.minimum(jnp.maximum(-low, high), _UNLIMITED), (count,))


@functools.lru_cache(maxsize=4096)
@kept_values
def robust_bandwidths(axis: Axis, order: int = 2) -> Bandwidths:
    """Bandwidths of an estimator of order 2, as of preset `robust`, or 1, state feedback and controlled actuators."""
    bandwidth, share, faster = (grid.ravel()[:, None] for grid in np.meshgrid(*_robust_grid(axis), indexing="ij"))
    # Actuators at their limits follow with their own lag. The damping predicts by 2 / tracking, which must exceed it.
    tracking = np.minimum(share * bandwidth, 1 / axis.response_time if np.isfinite(axis.authority) else np.inf)
    bandwidth = np.minimum(bandwidth, tracking / _TRACKING_SHARES[0])
    natural = 1 / axis.lag if axis.lag else 0.0
    actuators = np.minimum(np.maximum(faster * np.maximum(bandwidth, tracking), natural), axis.max_bandwidth)
    best = _best(axis, lambda s: _robust(axis, s, actuators, bandwidth, tracking, order), bandwidth)
    return Bandwidths(*(float(rate[best, 0]) for rate in (actuators, bandwidth, tracking)))


def default_bandwidths(axes: Sequence[Axis], bandwidth, tracking, actuator_rate, order: int = 2):
    """Bandwidth and tracking (one entry per axis) and actuator rate, each chosen if not given, rad/s and 1/s.

    Args:
        axes: data of each axis.
        bandwidth, tracking, actuator_rate: those that are given; None for the others. With a given bandwidth, tracking
            is between a quarter and half of it, and the actuators are three times as fast, if sampling allows.
        order: of the estimator, 1 or 2.

    Raises:
        BadInput: one that is given is not positive.
    """
    for name, value in (("bandwidth", bandwidth), ("tracking", tracking), ("actuator_rate", actuator_rate)):
        if value is not None:
            checks.positive(name, value, "rad/s")
    rates, *of_axes = zip(*(robust_bandwidths(axis, order) for axis in axes), strict=True)
    default = Bandwidths(max(rates), *(scalar_if_uniform(values) for values in of_axes))  # pyright: ignore[reportArgumentType] - one number or one per axis
    if bandwidth is None:
        rate, bandwidth, beside = default
    else:
        bandwidths = jnp.asarray(bandwidth, dtype=float)
        slowest, fastest = _BESIDE
        beside = jnp.clip(default.tracking, slowest * bandwidths, fastest * bandwidths)
        rate = jnp.minimum(axes[0].max_bandwidth, _ACTUATORS_FASTER * jnp.max(bandwidths))
    return bandwidth, beside if tracking is None else tracking, rate if actuator_rate is None else actuator_rate


@functools.lru_cache(maxsize=4096)
@kept_values
def pid_frequency(axis: Axis) -> float:
    """Natural frequency w of a PID with k_p = w^2, k_d = 2 w and k_i = w^3 / 10, rad/s: Fossen (2021), ch. 15."""
    return best_frequency(axis, lambda w, s: LoopTransfer(w**2 + 0.1 * w**3 / s, 2 * w + 0 * s))


def best_frequency(axis: Axis, law: Callable[[np.ndarray, np.ndarray], LoopTransfer]) -> float:
    """Frequency of least cost with all margins of a law with one free number, rad/s.

    Args:
        axis: data of the axis.
        law: (frequencies (candidates, 1), Laplace variables (frequencies,)) -> transfer functions of each candidate.
    """
    frequency = bandwidth_grid(axis)[:, None]
    return float(frequency[_best(axis, lambda s: law(frequency, s), frequency), 0])


def bandwidth_grid(axis: Axis) -> np.ndarray:
    """Bandwidths that the rule tries, rad/s, in rising order."""
    return np.geomspace(_SLOWEST / axis.response_time, _FASTEST / axis.sampling_time, _CANDIDATES)


def _robust_grid(axis: Axis) -> tuple[np.ndarray, ...]:
    return bandwidth_grid(axis), np.array(_TRACKING_SHARES), np.array(_ACTUATOR_SHARES if axis.lag else (3.0,))


def _robust(axis: Axis, s: np.ndarray, actuators, bandwidth, tracking, order: int = 2) -> LoopTransfer:
    """The law of `controllers/robust` from y to u: sampled estimator, actuators as in `LaggedActuator`."""
    dt, z = axis.sampling_time, np.exp(s * axis.sampling_time)
    decay = np.exp(-bandwidth * dt)
    if order == 1:
        of_estimate, poles = (1 - decay) / dt, z - decay
    else:
        of_estimate = (1 - decay) ** 2 / dt
        poles = (z - 1) ** 2 + (2 - 2 * decay) * (z - 1) + dt * of_estimate
    by_velocity, by_force = of_estimate * (z - 1) / poles, -dt * of_estimate / poles  # d_hat
    if axis.lag:
        pole, lead = np.exp(-dt / axis.lag), axis.lag * actuators
        force = (1 - pole) * lead / (z - pole - (1 - pole) * (1 - lead))  # per commanded force
        command = (1 - lead) * force + lead
    else:
        force = command = np.ones_like(z)
    closed_command = command / (1 + by_force * force)
    return LoopTransfer(tracking**2 * closed_command, (2 * tracking + by_velocity) * closed_command)


def _best(axis: Axis, law: Callable[[np.ndarray], LoopTransfer], rates: np.ndarray) -> int:
    """Index of the candidate of least cost among those with all margins; the slowest where none has them."""
    dt = axis.sampling_time
    frequency = np.geomspace(1e-4, np.pi, _FREQUENCIES) / dt
    s = 1j * frequency
    from_y = law(s)
    held = (1 - np.exp(-s * dt)) / (s * dt) * np.exp(-s * axis.delay)
    open_loop = held * (from_y.of_position / s**2 + from_y.of_velocity / s)
    order = np.argsort(_cost(axis, frequency, from_y, held, open_loop), kind="stable")
    for start in range(0, len(order), _AT_ONCE):
        batch = order[start : start + _AT_ONCE]
        allowed = np.ones(len(batch), dtype=bool)
        for factor, added, delay, largest in MARGINS:
            unknown_lag = axis.unknown_delay * (UNKNOWN_LAG if added and axis.lag is None else added)
            unknown_delay = np.exp(-s * delay * axis.unknown_delay)
            transfer = unknown_delay / ((1 + s * factor * (axis.lag or 0.0)) * (1 + s * unknown_lag))
            allowed &= _keeps(open_loop[batch] * transfer, largest)
        if allowed.any():
            return int(batch[allowed.argmax()])
    return int(rates.argmin())


def _cost(
    axis: Axis, frequency: np.ndarray, from_y: LoopTransfer, held: np.ndarray, open_loop: np.ndarray
) -> np.ndarray:
    """Predicted cost of each candidate, with the nominal actuators of the law."""
    s, dt = 1j * frequency, axis.sampling_time
    actuator = 1 / (1 + s * (axis.lag or 0.0))
    sensitivity = 1 / (1 + open_loop * actuator)
    rms = lambda transfer: np.sqrt(np.trapezoid(np.abs(transfer) ** 2, frequency, axis=-1) / np.pi)
    # A random walk, and a swell with the amplitude of the walk in one of its periods.
    swell = _at(_SWELL, frequency, np.abs(sensitivity / s**2)) * np.sqrt(2 * np.pi / _SWELL)
    by_load = axis.load_rate * np.hypot(rms(sensitivity / s**3), swell)
    noise = axis.velocity_noise * np.sqrt(dt)
    by_noise = noise * rms(from_y.of_velocity * held * actuator * sensitivity / s**2)
    # Mean size of a normal step from one sampling time to the next: sqrt(2 / pi) of its standard deviation.
    step = np.sqrt(2 / np.pi) * noise * rms((1 - np.exp(-s * dt)) * from_y.of_velocity * sensitivity)
    input_step = step / axis.authority + _jump_step(axis, frequency, open_loop)
    return np.hypot(by_load, by_noise) / _ERROR_SCALE + input_step / _STEP_SCALE


def _jump_step(axis: Axis, frequency: np.ndarray, open_loop: np.ndarray) -> np.ndarray:
    """Mean step of the input by jumps through the dead zone, as a share of its limit.

    A force below that of the zone's edge can be given on average only. Near rest the input jumps from one edge to the
    other, twice in a period of the crossover frequency. A lag of the actuators smooths this, and is not priced.
    """
    if axis.lag:
        return np.zeros(len(open_loop))
    crossover = np.where(np.abs(open_loop) >= 1, frequency, 0.0).max(axis=-1)
    return 2 * axis.dead_zone * crossover * axis.sampling_time / np.pi


def _at(point: float, frequency: np.ndarray, values: np.ndarray) -> np.ndarray:
    """Values at one frequency, linear in its logarithm."""
    above = np.clip(np.searchsorted(frequency, point), 1, len(frequency) - 1)
    share = np.clip(np.log(point / frequency[above - 1]) / np.log(frequency[above] / frequency[above - 1]), 0, 1)
    return (1 - share) * values[..., above - 1] + share * values[..., above]


def _keeps(open_loop: np.ndarray, largest: float) -> np.ndarray:
    """Whether the closed loop is stable (Nyquist) with no sensitivity above `largest`."""
    difference = 1 + open_loop
    turned = np.diff(np.unwrap(np.angle(difference), axis=-1)[..., [0, -1]], axis=-1)[..., 0]
    encircled = np.abs(turned - _INTEGRATORS * np.pi / 2) > np.pi / 2
    return ~encircled & (np.abs(difference).min(axis=-1) > 1 / largest)
