"""Gains and path of a law with an observer of second order and state feedback: `adrc` and `indi`."""

from typing import Any

import jax.numpy as jnp

from undertow.controllers.actuation import Actuation, actuation_for
from undertow.controllers.bandwidths import axes_of, completed
from undertow.core import checks
from undertow.core.contracts import Model
from undertow.core.errors import BadInput


def observer_gains(
    model: Model, sampling_time: float, conditions: tuple[Any, Any, float], gains: tuple[Any, ...], **path: Any
) -> tuple[Any, Any, Actuation]:
    """Bandwidth of the observer, rad/s, feedback K, 1/s^2 and 1/s, and the path from the demanded acceleration.

    Args:
        model: nominal model, in the coordinates of the law.
        sampling_time: that of the loop, s.
        conditions: noise of the velocity, random walk of the loads and delay, as in `bandwidths.axes_of`.
        gains: bandwidth, tracking, feedback and actuator rate; None for those that the rule of preset `robust` chooses.
        path: options of `actuation_for`. With a given feedback there is no filter of reference jumps by default.

    Raises:
        BadInput: a value is out of its range, or there are both `tracking` and `feedback`.
    """
    (noise, load_rate, delay), (bandwidth, tracking, feedback, actuator_rate) = conditions, gains
    checks.positive("sampling_time", sampling_time, "s")
    if feedback is not None and tracking is not None:
        raise BadInput("tracking", "be left out when there is `feedback`", tracking)
    axes = axes_of(model, sampling_time, delay, noise, load_rate)
    bandwidth, tracking, actuator_rate = completed(axes, bandwidth, tracking, actuator_rate)
    if feedback is None:
        rate = jnp.asarray(tracking, dtype=float)
        feedback = jnp.stack([rate**2, 2 * rate], -1)
    elif path["reference_frequency"] is None:
        path["reference_frequency"] = 0.0
    return bandwidth, feedback, actuation_for(sampling_time, tracking, actuator_rate=actuator_rate, **path)
