"""How fast each part of the law may be: section 3.12 of the theory."""

from typing import NamedTuple

import jax.numpy as jnp
from jaxtyping import Array, Float

from undertow.core import checks
from undertow.core.drive import AbstractDrive, DirectDrive

# Share of the sampling rate: what is faster is at the mercy of sampling.
_SAMPLED = 0.35

# A delay that nobody knows of eats the estimator's margin from about one radian on; a third of that is left to it.
_DELAYED = 0.35

# Motors need not be faster than this many times what the estimator asks of them; more only passes on noise.
_NEEDED = 3.0

# The tracking error is made slower than the estimator that has to have found the load. With 0.4 an axis whose actuator
# obeys at once bears 2.3 ticks of delay, and an input of 0.16 to 8.8 times the expected effect. Motors have less to
# spare: faster than 0.2 they swing from limit to limit.
_TRACKING, _TRACKING_BEHIND_LAG = 0.4, 0.2


class Speeds(NamedTuple):
    """Rates in rad/s and 1/s, the inner loop first."""

    actuators: Float[Array, ""]
    bandwidth: Float[Array, "..."]
    tracking: Float[Array, "..."]


def speeds(
    sampling_time: float,
    bandwidth=None,
    tracking=None,
    actuators=None,
    velocity_noise=0.0,
    load_rate=1.0,
    delay: float = 0.0,
    drive: AbstractDrive | None = None,
) -> Speeds:
    """What is not given is as fast as the loop inside it, noise and delay allow.

    Args:
        sampling_time: s.
        bandwidth: of the estimator, rad/s.
        tracking: natural frequency of the tracking error, rad/s.
        actuators: rate at which motors follow, 1/s.
        velocity_noise: standard deviation of the measured velocities at each tick, m/s and rad/s.
        load_rate: how fast loads wander, m/s^2 per sqrt(s) and rad/s^2 per sqrt(s).
        delay: of measurement and input together that nothing makes up for, s.
        drive: of the actuators; None for one of which nothing is known.

    Raises:
        BadInput: a value that is not positive, or negative.
    """
    checks.positive("sampling_time", sampling_time, "s")
    checks.not_negative("velocity_noise", velocity_noise, "m/s, rad/s")
    checks.positive("load_rate", load_rate)
    checks.not_negative("delay", delay, "s")
    drive = DirectDrive() if drive is None else drive
    sampled = jnp.asarray(_SAMPLED / sampling_time, dtype=float)
    most = drive.quickest(sampled)
    slowest = drive.lag(most if actuators is None else jnp.asarray(actuators, dtype=float))
    if bandwidth is None:
        inner = jnp.where(slowest > 0, 1 / jnp.where(slowest > 0, slowest, 1.0), jnp.inf)
        bandwidth = jnp.minimum(sampled, kalman(sampling_time, velocity_noise, load_rate))
        bandwidth = jnp.minimum(jnp.minimum(bandwidth, inner), _DELAYED / delay if delay else jnp.inf)
    checks.positive("bandwidth", bandwidth, "rad/s")
    if actuators is None:
        actuators = jnp.minimum(most, _NEEDED * jnp.max(jnp.asarray(bandwidth, dtype=float)))
    checks.positive("actuator_rate", actuators, "1/s")
    if tracking is None:
        share = jnp.where(slowest > 0, _TRACKING_BEHIND_LAG, _TRACKING)
        tracking = share * jnp.asarray(bandwidth, dtype=float)
    checks.positive("tracking", tracking, "rad/s")
    return Speeds(*(jnp.asarray(value, dtype=float) for value in (actuators, bandwidth, tracking)))


def kalman(sampling_time: float, velocity_noise, load_rate) -> Float[Array, "..."]:
    """(q^2 / (sigma^2 T))^(1/4), rad/s: the steady Kalman filter of v_dot = u + d, d a random walk. Section 3.1."""
    density = jnp.asarray(velocity_noise, dtype=float) ** 2 * sampling_time
    ratio = jnp.asarray(load_rate, dtype=float) ** 2 / jnp.where(density > 0, density, 1.0)
    return jnp.where(density > 0, ratio**0.25, jnp.inf)
