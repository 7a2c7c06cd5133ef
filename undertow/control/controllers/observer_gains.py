"""Gains and path of the laws with an observer of the load: bandwidths by the rule, and the path of the acceleration."""

import dataclasses
from typing import Any

import jax.numpy as jnp

from undertow.control.controllers.actuation import Actuation, actuation_for
from undertow.control.controllers.bandwidths import axes_of, default_bandwidths
from undertow.control.controllers.options import ActuationOptions, DesignConditions
from undertow.core.contracts import Model
from undertow.core.errors import BadInput


def gains_and_path(
    model: Model, conditions: DesignConditions, actuation: ActuationOptions, gains: tuple[Any, Any], order: int
) -> tuple[Any, Any, Actuation]:
    """Bandwidth of the observer and natural frequency of the tracking error, rad/s, and the path of the acceleration.

    Args:
        model: nominal model, in the coordinates of the law.
        conditions: what the law is designed for.
        actuation: options of the path; without an actuator rate the rule chooses it, too.
        gains: bandwidth and tracking; None for those that the rule of preset `robust` chooses.
        order: of the observer, 1 or 2.

    Raises:
        BadInput: a value is out of its range.
    """
    axes = axes_of(model, conditions)
    bandwidth, tracking, actuator_rate = default_bandwidths(axes, *gains, actuation.actuator_rate, order=order)
    path_options = dataclasses.replace(actuation, actuator_rate=actuator_rate)
    return bandwidth, tracking, actuation_for(conditions.sampling_time, tracking, path_options)


def gains_with_feedback(
    model: Model, conditions: DesignConditions, actuation: ActuationOptions, gains: tuple[Any, Any, Any]
) -> tuple[Any, Any, Actuation]:
    """Bandwidth of an observer of second order, rad/s, feedback K, 1/s^2 and 1/s, and the path: `adrc` and `indi`.

    Args:
        model, conditions: as in `gains_and_path`.
        actuation: likewise. With a given feedback there is no filter of reference jumps by default.
        gains: bandwidth, tracking and feedback; None for those that the rule chooses.

    Raises:
        BadInput: a value is out of its range, or there are both `tracking` and `feedback`.
    """
    bandwidth, tracking, feedback = gains
    if feedback is not None and tracking is not None:
        raise BadInput("tracking", "be left out when there is `feedback`", tracking)
    if feedback is not None and actuation.reference_frequency is None:
        actuation = dataclasses.replace(actuation, reference_frequency=0.0)
    bandwidth, tracking, path = gains_and_path(model, conditions, actuation, (bandwidth, tracking), order=2)
    if feedback is None:
        rate = jnp.asarray(tracking, dtype=float)
        feedback = jnp.stack([rate**2, 2 * rate], -1)
    return bandwidth, feedback, path
