"""Disturbance-observer-based control: state feedback that cancels the estimate of a nonlinear observer."""

from typing import NamedTuple

import jax.numpy as jnp
from jaxtyping import Array, Float

from undertow.control.controllers.actuation import AbstractAccelerationLaw, Actuation, ActuationResult
from undertow.control.controllers.law_signals import ATTAINED_SHARE, ESTIMATE
from undertow.control.controllers.observer_gains import gains_and_path
from undertow.control.controllers.options import ActuationOptions, DesignConditions
from undertow.control.controllers.tracking_error import pole_placement
from undertow.control.estimation.sampled_observer import corrected_disturbance
from undertow.core import checks
from undertow.core.contracts import Measurement, Model, Target, TrackingError
from undertow.core.option_groups import flat_options
from undertow.core.param import Param, param

PerAxis = Float[Array, " n"]


class DisturbanceObserverState(NamedTuple):
    """State of the law: the prediction that the next measured velocity corrects."""

    predicted: PerAxis  # m/s, rad/s
    estimate: PerAxis  # d_hat with which it was predicted, m/s^2, rad/s^2
    elapsed: Float[Array, ""]  # s


class DisturbanceObserver(AbstractAccelerationLaw):
    """a = a_d + w^2 e + 2 zeta w e_dot - d_hat with d_hat_dot = l (d - d_hat), the observer of Chen et al. (2000).

    The observer d_hat = z + l v with z_dot = -l z - l (l v + F + G f) needs no acceleration. It is sampled exactly: the
    error of the estimate of a load that is constant over a step falls by exp(-l T).

    Raises:
        BadInput: a gain is not positive.
    """

    model: Model
    actuation: Actuation
    bandwidth: Float[Param, "..."] = param("rad/s", "bandwidth of the observer", symbol="l", range=(0.3, 30.0))
    tracking: Float[Param, "..."] = param(
        "rad/s", "natural frequency of the tracking error", symbol="w", range=(0.2, 15.0)
    )
    damping: Float[Param, "..."] = param("", "its damping ratio", symbol="zeta", range=(0.5, 3.0))

    def __check_init__(self):
        for name in ("bandwidth", "tracking", "damping"):
            checks.positive(name, getattr(self, name))
            checks.per_axis(name, getattr(self, name), len(self.model.coordinates.angles))

    def init_law(self, y: Measurement, r: Target) -> DisturbanceObserverState:
        velocity = self.model.coordinates.velocity(y)
        return DisturbanceObserverState(velocity, jnp.zeros_like(velocity), jnp.zeros(()))

    def acceleration(self, state: DisturbanceObserverState, y: Measurement, tracking_error: TrackingError):
        estimate = self._estimate(state, y)
        return pole_placement(tracking_error, self.tracking, self.damping) - estimate, {"estimate": estimate}

    def update(
        self,
        state: DisturbanceObserverState,
        y: Measurement,
        tracking_error: TrackingError,
        actuation: ActuationResult,
        dt,
    ) -> DisturbanceObserverState:
        estimate = self._estimate(state, y)
        return DisturbanceObserverState(
            self.model.coordinates.velocity(y) + dt * (actuation.modelled + estimate), estimate, dt
        )

    def signals(self):
        return ESTIMATE | ATTAINED_SHARE

    def _estimate(self, state: DisturbanceObserverState, y: Measurement) -> PerAxis:
        velocity = self.model.coordinates.velocity(y)
        return corrected_disturbance(state.estimate, state.predicted, velocity, self.bandwidth, state.elapsed)


@flat_options()
def disturbance_observer(
    model: Model,
    *,
    conditions: DesignConditions = DesignConditions(),
    bandwidth=None,
    tracking=None,
    damping=1.0,
    actuation: ActuationOptions = ActuationOptions(motor="computed"),
) -> DisturbanceObserver:
    """Disturbance-observer-based control: Chen, Ballance, Gawthrop and O'Reilly (2000), Eqs. (7)-(13). Body axes.

    Against `adrc`, the observer is of first order in each axis and does not estimate the velocity again.

    Args:
        model: nominal model, from `plant.model()`.
        bandwidth: l, pole of the observer, rad/s; one number or one per axis. None: the one of least predicted cost
            that keeps the margins of `bandwidths.py`.
        tracking: natural frequency of the tracking error, rad/s; None: chosen with the bandwidth; with a given
            bandwidth between a quarter and half of it.
        damping: damping ratio of the tracking error.
        actuator_rate: with motor = computed, bandwidth of the motor loop, 1/s; None: chosen with the bandwidth.

    Raises:
        BadInput: a value is out of its range.
    """
    model = model.in_body_axes()
    bandwidth, tracking, path = gains_and_path(model, conditions, actuation, (bandwidth, tracking), order=1)
    return DisturbanceObserver(model=model, actuation=path, bandwidth=bandwidth, tracking=tracking, damping=damping)
