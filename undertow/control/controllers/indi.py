"""Incremental nonlinear dynamic inversion (INDI): the input changes by the error of the acceleration."""

from typing import NamedTuple

import jax.numpy as jnp
from jaxtyping import Array, Float

from undertow.control.controllers.actuation import AbstractAccelerationLaw, Actuation, ActuationResult
from undertow.control.controllers.law_signals import ATTAINED_SHARE, ESTIMATE, MODELLING_ERROR
from undertow.control.controllers.observer_gains import gains_with_feedback
from undertow.control.controllers.options import ActuationOptions, DesignConditions
from undertow.control.controllers.tracking_error import check_second_order_gains
from undertow.core.contracts import Measurement, Model, Target, TrackingError
from undertow.core.option_groups import flat_options
from undertow.core.param import Param, param

PerAxis = Float[Array, " n"]


class INDIState(NamedTuple):
    """State of the law: the filters H of the velocity and of the modelled acceleration; SI units."""

    velocity: PerAxis
    acceleration: PerAxis  # its derivative
    modelled: PerAxis
    modelled_rate: PerAxis


class INDI(AbstractAccelerationLaw):
    """G f = a_d + k_1 e + k_2 e_dot - F - (H v_dot - H (F + G f)): no observer of the load.

    H = w^2 / (p^2 + 2 zeta w p + w^2), by Euler's method; the acceleration is the slope of the filtered velocity. In
    continuous time this is ADRC of the same bandwidth.

    Raises:
        BadInput: bandwidth or damping not positive, or feedback not Hurwitz.
    """

    model: Model
    actuation: Actuation
    bandwidth: Float[Param, "..."] = param("rad/s", "natural frequency of the filter", symbol="w")
    damping: Float[Param, "..."] = param("", "damping ratio of the filter", symbol="zeta")
    feedback: Float[Param, "*#n 2"] = param("1/s^2, 1/s", "state feedback", symbol="K")

    def __check_init__(self):
        check_second_order_gains(self.bandwidth, self.damping, self.feedback, len(self.model.coordinates.angles))

    def init_law(self, y: Measurement, r: Target) -> INDIState:
        rates = self.model.coordinates.velocity(y)
        zero = jnp.zeros_like(rates)
        return INDIState(rates, zero, zero, zero)

    def acceleration(self, state: INDIState, y: Measurement, tracking_error: TrackingError):
        error, rate, acceleration = tracking_error
        missing = state.acceleration - state.modelled
        feedback = acceleration + self.feedback[..., 0] * error + self.feedback[..., 1] * rate
        signals = {"estimate": missing, "modelling_error": state.velocity - self.model.coordinates.velocity(y)}
        return feedback - missing, signals

    def update(
        self, state: INDIState, y: Measurement, tracking_error: TrackingError, actuation: ActuationResult, dt
    ) -> INDIState:
        velocity, acceleration = self._filtered(
            state.velocity, state.acceleration, self.model.coordinates.velocity(y), dt
        )
        return INDIState(
            velocity, acceleration, *self._filtered(state.modelled, state.modelled_rate, actuation.modelled, dt)
        )

    def signals(self):
        return ESTIMATE | MODELLING_ERROR | ATTAINED_SHARE

    def _filtered(self, value: PerAxis, slope: PerAxis, heading: PerAxis, dt) -> tuple[PerAxis, PerAxis]:
        """Output of H and its derivative one sampling time later."""
        pull = self.bandwidth**2 * (heading - value) - 2 * self.damping * self.bandwidth * slope
        return value + dt * slope, slope + dt * pull


@flat_options()
def indi(
    model: Model,
    *,
    conditions: DesignConditions = DesignConditions(),
    bandwidth=None,
    damping=1.0,
    tracking=None,
    feedback=None,
    actuation: ActuationOptions = ActuationOptions(motor="computed"),
) -> INDI:
    """Incremental nonlinear dynamic inversion: Sieberling, Chu and Mulder (2010), Smeur et al. (2016). Body axes.

    Args:
        model: nominal model, from `plant.model()`.
        bandwidth: natural frequency of the filter of velocity and input, rad/s; one number or one per axis. None: as
            in preset `robust`, the one of least predicted cost that keeps the margins of `bandwidths.py`.
        damping: its damping ratio; one number or one per axis.
        tracking: natural frequency of the tracking error, critically damped, rad/s; None: chosen with the bandwidth;
            with a given bandwidth between a quarter and half of it.
        feedback: K = (k1, k2) instead of `tracking`, 1/s^2 and 1/s; one pair or one per axis.
        reference_frequency: that of the filter of reference jumps, rad/s; None: half of `tracking`, 2 at most, or none
            with a given `feedback`; 0 for no filter.
        actuator_rate: with motor = computed, bandwidth of the motor loop, 1/s; None: chosen with the bandwidth; with a
            given bandwidth three times that, if sampling allows.

    Raises:
        BadInput: a value is out of its range, or two options set the same quantity.
    """
    model = model.in_body_axes()
    bandwidth, feedback, path = gains_with_feedback(model, conditions, actuation, (bandwidth, tracking, feedback))
    return INDI(model=model, actuation=path, bandwidth=bandwidth, damping=damping, feedback=feedback)
