"""L1 adaptive control: a state predictor, piecewise-constant adaptation, and a low-pass filter of what is cancelled."""

from typing import NamedTuple

import jax.numpy as jnp
from jaxtyping import Array, Float

from undertow.control.controllers.actuation import AbstractAccelerationLaw, Actuation, ActuationResult
from undertow.control.controllers.law_signals import ATTAINED_SHARE, ESTIMATE, MODELLING_ERROR
from undertow.control.controllers.observer_gains import gains_and_path
from undertow.control.controllers.options import ActuationOptions, DesignConditions
from undertow.control.controllers.tracking_error import pole_placement
from undertow.core import checks
from undertow.core.contracts import Measurement, Model, Target, TrackingError
from undertow.core.option_groups import flat_options
from undertow.core.param import Param, param

PerAxis = Float[Array, " n"]


class PredictorState(NamedTuple):
    """State of the law."""

    predicted: PerAxis  # v_hat, m/s, rad/s
    filtered: PerAxis  # C(s) sigma_hat of the sampling time before, m/s^2, rad/s^2
    elapsed: Float[Array, ""]  # s, since then


class Adapted(NamedTuple):
    """What one measurement gives."""

    error: PerAxis  # v_tilde = v_hat - v, m/s, rad/s
    uncertainty: PerAxis  # sigma_hat, m/s^2, rad/s^2
    filtered: PerAxis  # C(s) sigma_hat


class L1Adaptive(AbstractAccelerationLaw):
    """a = a_d + w^2 e + 2 zeta w e_dot - C(s) sigma_hat, C(s) = w_c / (s + w_c).

    Predictor: v_hat_dot = F + G f + sigma_hat - a_s v_tilde. Adaptation at each sampling time:
    sigma_hat = -a_s exp(-a_s T) / (1 - exp(-a_s T)) v_tilde, which makes v_tilde at the next one independent of this
    one: it is minus the integral of the uncertainty over the step, at most T times its largest value. The speed of the
    adaptation is that of sampling; robustness is set by w_c alone.

    Raises:
        BadInput: a gain is not positive.
    """

    model: Model
    actuation: Actuation
    predictor: Float[Param, "..."] = param("1/s", "decay rate of the predictor's error", symbol="a_s")
    bandwidth: Float[Param, "..."] = param("rad/s", "bandwidth of the filter C(s)", symbol="w_c", range=(0.3, 30.0))
    tracking: Float[Param, "..."] = param(
        "rad/s", "natural frequency of the tracking error", symbol="w", range=(0.2, 15.0)
    )
    damping: Float[Param, "..."] = param("", "its damping ratio", symbol="zeta", range=(0.5, 3.0))

    def __check_init__(self):
        for name in ("predictor", "bandwidth", "tracking", "damping"):
            checks.positive(name, getattr(self, name))
            checks.per_axis(name, getattr(self, name), len(self.model.coordinates.angles))

    def init_law(self, y: Measurement, r: Target) -> PredictorState:
        velocity = self.model.coordinates.velocity(y)
        return PredictorState(velocity, jnp.zeros_like(velocity), jnp.zeros(()))

    def acceleration(self, state: PredictorState, y: Measurement, tracking_error: TrackingError):
        adapted = self._adapted(state, y)
        return pole_placement(tracking_error, self.tracking, self.damping) - adapted.filtered, {
            "estimate": adapted.filtered,
            "modelling_error": adapted.error,
        }

    def update(
        self, state: PredictorState, y: Measurement, tracking_error: TrackingError, actuation: ActuationResult, dt
    ) -> PredictorState:
        adapted = self._adapted(state, y)
        velocity = self.model.coordinates.velocity(y)
        decayed = -jnp.expm1(-self.predictor * dt)
        correction = (1 - decayed) * adapted.error + decayed / self.predictor * adapted.uncertainty
        return PredictorState(velocity + dt * actuation.modelled + correction, adapted.filtered, dt)

    def signals(self):
        return ESTIMATE | MODELLING_ERROR | ATTAINED_SHARE

    def _adapted(self, state: PredictorState, y: Measurement) -> Adapted:
        step = jnp.where(state.elapsed > 0, state.elapsed, 1.0)
        error = state.predicted - self.model.coordinates.velocity(y)
        uncertainty = -self.predictor / jnp.expm1(self.predictor * step) * error
        share = -jnp.expm1(-self.bandwidth * state.elapsed)
        return Adapted(error, uncertainty, state.filtered + share * (uncertainty - state.filtered))


@flat_options()
def l1_adaptive(
    model: Model,
    *,
    conditions: DesignConditions = DesignConditions(),
    predictor=1.0,
    bandwidth=None,
    tracking=None,
    damping=1.0,
    actuation: ActuationOptions = ActuationOptions(motor="computed"),
) -> L1Adaptive:
    """L1 adaptive control with piecewise-constant adaptation: Hovakimyan and Cao (2010), section 3.3. Body axes.

    The reference system is the tracking error with state feedback; the predictor runs on the velocities, whose
    equation holds all of the uncertainty of a fully actuated plant. A constant load leaves the share
    1 - a_s T / (exp(a_s T) - 1) of itself uncompensated, about a_s T / 2.

    Args:
        model: nominal model, from `plant.model()`.
        predictor: a_s, decay rate of the error of the predictor, 1/s; one number or one per axis.
        bandwidth: w_c of the low-pass filter, rad/s; one number or one per axis. None: the one of least predicted cost
            that keeps the margins of `bandwidths.py`, for a_s T = 0.
        tracking: natural frequency of the tracking error, rad/s; None: chosen with the bandwidth; with a given
            bandwidth between a quarter and half of it.
        damping: damping ratio of the tracking error.
        actuator_rate: with motor = computed, bandwidth of the motor loop, 1/s; None: chosen with the bandwidth.

    Raises:
        BadInput: a value is out of its range.
    """
    model = model.in_body_axes()
    bandwidth, tracking, path = gains_and_path(model, conditions, actuation, (bandwidth, tracking), order=1)
    return L1Adaptive(
        model=model, actuation=path, predictor=predictor, bandwidth=bandwidth, tracking=tracking, damping=damping
    )
