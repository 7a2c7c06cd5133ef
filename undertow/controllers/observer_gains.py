"""Gains and path of the laws with an observer of the load: bandwidths by the rule, and the path of the acceleration."""

from typing import Any

import jax.numpy as jnp

from undertow.controllers.actuation import Actuation, actuation_for
from undertow.controllers.bandwidths import axes_of, completed
from undertow.core.contracts import Model
from undertow.core.errors import BadInput


def gains_and_path(
    model: Model,
    sampling_time: float,
    conditions: tuple[Any, Any, float],
    gains: tuple[Any, Any, Any],
    order: int,
    **path: Any,
) -> tuple[Any, Any, Actuation]:
    """Bandwidth of the observer and natural frequency of the tracking error, rad/s, and the path of the acceleration.

    Args:
        model: nominal model, in the coordinates of the law.
        sampling_time: that of the loop, s.
        conditions: noise of the velocity, random walk of the loads and delay, as in `bandwidths.axes_of`.
        gains: bandwidth, tracking and actuator rate; None for those that the rule of preset `robust` chooses.
        order: of the observer, 1 or 2.
        path: options of `actuation_for`.

    Raises:
        BadInput: a value is out of its range.
    """
    noise, load_rate, delay = conditions
    axes = axes_of(model, sampling_time, delay, noise, load_rate)
    bandwidth, tracking, actuator_rate = completed(axes, *gains, order=order)
    return bandwidth, tracking, actuation_for(sampling_time, tracking, actuator_rate=actuator_rate, **path)


def gains_with_feedback(
    model: Model, sampling_time: float, conditions: tuple[Any, Any, float], gains: tuple[Any, ...], **path: Any
) -> tuple[Any, Any, Actuation]:
    """Bandwidth of an observer of second order, rad/s, feedback K, 1/s^2 and 1/s, and the path: `adrc` and `indi`.

    Args:
        model, sampling_time, conditions: as in `gains_and_path`.
        gains: bandwidth, tracking, feedback and actuator rate; None for those that the rule chooses.
        path: options of `actuation_for`. With a given feedback there is no filter of reference jumps by default.

    Raises:
        BadInput: a value is out of its range, or there are both `tracking` and `feedback`.
    """
    bandwidth, tracking, feedback, actuator_rate = gains
    if feedback is not None and tracking is not None:
        raise BadInput("tracking", "be left out when there is `feedback`", tracking)
    if feedback is not None and path["reference_frequency"] is None:
        path["reference_frequency"] = 0.0
    chosen = (bandwidth, tracking, actuator_rate)
    bandwidth, tracking, along = gains_and_path(model, sampling_time, conditions, chosen, 2, **path)
    if feedback is None:
        rate = jnp.asarray(tracking, dtype=float)
        feedback = jnp.stack([rate**2, 2 * rate], -1)
    return bandwidth, feedback, along
