"""How fast each part of the law may be: section 3.12 of the theory."""

from typing import NamedTuple

import jax.numpy as jnp
from jaxtyping import Array, Float

from undertow.core import checks

# Shares of a sampling rate: an estimator faster than the first is at the mercy of sampling, a motor loop faster than
# the second asks a current loop three times as fast for more than it can do.
_ESTIMATOR, _ACTUATORS = 0.35, 0.15

# The tracking error is made slower than the estimator that has to have found the load.
_TRACKING = 0.2


class Speeds(NamedTuple):
    """Rates in rad/s and 1/s, the inner loop first."""

    actuators: Float[Array, ""]
    bandwidth: Float[Array, "..."]
    tracking: Float[Array, "..."]


def speeds(sampling_time: float, bandwidth=None, tracking=None, actuators=None) -> Speeds:
    """What is not given is as fast as the loop inside it allows.

    Args:
        sampling_time: s.
        bandwidth: of the estimator, rad/s.
        tracking: natural frequency of the tracking error, rad/s.
        actuators: rate at which motors follow, 1/s.

    Raises:
        BadInput: a value that is not positive.
    """
    checks.positive("sampling_time", sampling_time, "s")
    if actuators is None:
        actuators = _ACTUATORS / sampling_time
    checks.positive("actuator_rate", actuators, "1/s")
    if bandwidth is None:
        bandwidth = jnp.minimum(_ESTIMATOR / sampling_time, actuators)
    checks.positive("bandwidth", bandwidth, "rad/s")
    if tracking is None:
        tracking = _TRACKING * jnp.asarray(bandwidth, dtype=float)
    checks.positive("tracking", tracking, "rad/s")
    return Speeds(*(jnp.asarray(value, dtype=float) for value in (actuators, bandwidth, tracking)))
