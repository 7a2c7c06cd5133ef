"""Active disturbance rejection: a linear extended-state observer and state feedback."""

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


class ExtendedStateObserverState(NamedTuple):
    """State of the law: the estimates of the observer."""

    rates: PerAxis  # m/s, rad/s
    estimate: PerAxis  # d_hat, m/s^2, rad/s^2


class ADRC(AbstractAccelerationLaw):
    """v_hat_dot = F + G f + d_hat - 2 zeta w_o eps and d_hat_dot = -w_o^2 eps, with eps = v_hat - v, by Euler's method.

    The demanded acceleration is a_d + k_1 e + k_2 e_dot - d_hat. The observer uses the applied input, so limits cause
    no windup.

    Raises:
        BadInput: bandwidth or damping not positive, or feedback not Hurwitz.
    """

    model: Model
    actuation: Actuation
    bandwidth: Float[Param, "..."] = param("rad/s", "natural frequency of the observer", symbol="w_o")
    damping: Float[Param, "..."] = param("", "damping ratio of the observer", symbol="zeta")
    feedback: Float[Param, "*#n 2"] = param("1/s^2, 1/s", "state feedback", symbol="K")

    def __check_init__(self):
        check_second_order_gains(self.bandwidth, self.damping, self.feedback, len(self.model.coordinates.angles))

    def init_law(self, y: Measurement, r: Target) -> ExtendedStateObserverState:
        rates = self.model.coordinates.velocity(y)
        return ExtendedStateObserverState(rates, jnp.zeros_like(rates))

    def acceleration(self, state: ExtendedStateObserverState, y: Measurement, tracking_error: TrackingError):
        error, rate, acceleration = tracking_error
        feedback = acceleration + self.feedback[..., 0] * error + self.feedback[..., 1] * rate
        signals = {"estimate": state.estimate, "modelling_error": state.rates - self.model.coordinates.velocity(y)}
        return feedback - state.estimate, signals

    def update(
        self,
        state: ExtendedStateObserverState,
        y: Measurement,
        tracking_error: TrackingError,
        actuation: ActuationResult,
        dt,
    ) -> ExtendedStateObserverState:
        eps = state.rates - self.model.coordinates.velocity(y)
        return ExtendedStateObserverState(
            state.rates + dt * (actuation.modelled + state.estimate - 2 * self.damping * self.bandwidth * eps),
            state.estimate - dt * self.bandwidth**2 * eps,
        )

    def signals(self):
        return ESTIMATE | MODELLING_ERROR | ATTAINED_SHARE


@flat_options()
def adrc(
    model: Model,
    *,
    conditions: DesignConditions = DesignConditions(),
    bandwidth=None,
    damping=1.0,
    tracking=None,
    feedback=None,
    actuation: ActuationOptions = ActuationOptions(motor="computed"),
) -> ADRC:
    """Active disturbance rejection control (ADRC): Han (2009), with the bandwidths of Gao (2003). Body axes.

    Args:
        model: nominal model, from `plant.model()`.
        bandwidth: natural frequency of the extended-state observer, rad/s; one number or one per axis. None: as
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
    return ADRC(model=model, actuation=path, bandwidth=bandwidth, damping=damping, feedback=feedback)
