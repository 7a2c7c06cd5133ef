"""Tracking error in the coordinates of the law, and the filtered error s."""

from typing import Any, NamedTuple

import jax.numpy as jnp
from jaxtyping import Array, Float

from undertow.core import checks
from undertow.core.contracts import AbstractCoordinates, Measurement, Target, TrackingError

PerAxis = Float[Array, " n"]
# One for all axes, or one per axis.
Feedback = Float[Array, "*#n 2"]
Matrices = Float[Array, "*#n 2 2"]


class Tracking(NamedTuple):
    """E of Eq. (19), the filtered error and the acceleration of the target."""

    error: PerAxis  # e, m, rad
    rate: PerAxis  # m/s, rad/s
    filtered: PerAxis  # s = E^T P b
    acceleration: PerAxis  # of the target, m/s^2, rad/s^2

    def feedback(self, gains: Feedback) -> PerAxis:
        """K^T E, m/s^2 and rad/s^2."""
        return gains[..., 0] * self.error + gains[..., 1] * self.rate


def tracking(coordinates: AbstractCoordinates, lyapunov: Matrices, y: Measurement, r: Target) -> Tracking:
    """Errors of a measurement against a target, with P of Eq. (21)."""
    error, rate, acceleration = coordinates.tracking_error(y, r)
    return Tracking(error, rate, lyapunov[..., 0, 1] * error + lyapunov[..., 1, 1] * rate, acceleration)


def pole_placement(
    tracking_error: TrackingError, frequency: Float[Array, "..."], damping: Float[Array, "..."]
) -> PerAxis:
    """a_d + w^2 e + 2 zeta w e_dot, m/s^2 and rad/s^2: where it is given, e_ddot = -w^2 e - 2 zeta w e_dot.

    Args:
        tracking_error: errors from the target, and its acceleration.
        frequency: w, rad/s; one number or one per axis.
        damping: zeta.
    """
    return (
        tracking_error.acceleration
        + frequency**2 * tracking_error.error
        + 2 * damping * frequency * tracking_error.rate
    )


def check_gains(feedback: Array, weight: Array, per_axis: dict[str, Any], axes: int) -> None:
    """Check that K, Q and other gains fit the axes, and that K and Q satisfy Eq. (21).

    Raises:
        BadInput: one of them does not.
    """
    for name, value in per_axis.items():
        checks.per_axis(name, value, axes)
    checks.per_axis("feedback", feedback, axes, (2,))
    checks.per_axis("weight", weight, axes, (2, 2))
    checks.hurwitz("feedback", feedback)
    checks.positive_definite("weight", weight)


def check_second_order_gains(bandwidth: Array, damping: Array, feedback: Array, axes: int) -> None:
    """Check bandwidth and damping of an observer or a filter of second order, and the state feedback K beside it.

    Raises:
        BadInput: bandwidth or damping not positive, feedback not Hurwitz, or one of them does not fit the axes.
    """
    checks.positive("bandwidth", bandwidth, "rad/s")
    checks.positive("damping", damping)
    check_gains(feedback, jnp.eye(2), {"bandwidth": bandwidth, "damping": damping}, axes)
