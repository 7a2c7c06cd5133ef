"""Disturbance observer of first order, sampled exactly."""

import jax.numpy as jnp
from jaxtyping import Array, Float

PerAxis = Float[Array, " n"]


def corrected_disturbance(
    estimate: PerAxis, predicted: PerAxis, velocity: PerAxis, bandwidth: Float[Array, "..."], elapsed: Float[Array, ""]
) -> PerAxis:
    """The estimate of a disturbance, corrected by the part of the measured velocity that was not predicted.

    The error of the estimate of a disturbance that is constant over a step falls by exp(-bandwidth * elapsed).

    Args:
        estimate: with which the velocity was predicted, m/s^2, rad/s^2.
        predicted: velocity, m/s, rad/s.
        velocity: as measured.
        bandwidth: of the observer, rad/s.
        elapsed: time since the prediction, s; 0 before the first one.
    """
    step = jnp.where(elapsed > 0, elapsed, 1.0)
    gain = -jnp.expm1(-bandwidth * step) / step
    return estimate + gain * (velocity - predicted)
