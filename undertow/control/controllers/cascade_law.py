"""A cascade: a proportional law for the position and a PID law for the velocity; likewise for attitude and rate."""

from typing import NamedTuple

import jax.numpy as jnp
from jaxtyping import Array, Float

from undertow.control.controllers.actuation import AbstractAccelerationLaw, Actuation, ActuationResult
from undertow.control.controllers.law_signals import ATTAINED_SHARE, ESTIMATE
from undertow.core import checks
from undertow.core.contracts import Measurement, Model, Target, TrackingError
from undertow.core.numerics.linear_algebra import safe_sqrt
from undertow.core.param import Param, param

PerAxis = Float[Array, " n"]


class CascadeState(NamedTuple):
    """State of the law."""

    integral: PerAxis  # acceleration of the integral, m/s^2, rad/s^2
    smooth: PerAxis  # low-pass of the error of the rates for the derivative, m/s, rad/s
    elapsed: Float[Array, ""]  # s


class Cascade(AbstractAccelerationLaw):
    """Rates are demanded in proportion to the error, and followed by a PID law: v_d + clip(p e) - v = e_v and
    a = clip(a_d + k e_v + k_i integral of e_v + k_d d/dt e_v).

    Without its limits and its derivative this is `pid` with k_p = k p + k_i, integral gain k_i p and derivative gain k.

    Raises:
        BadInput: a gain or a limit of the wrong sign.
    """

    model: Model
    actuation: Actuation
    outer: Float[Param, "..."] = param("1/s", "rate demanded per error", symbol="p", range=(0.05, 15.0))
    inner: Float[Param, "..."] = param("1/s", "acceleration per error of the rate", symbol="k", range=(0.2, 40.0))
    integral: Float[Param, "..."] = param("1/s^2", "its integral gain", symbol="k_i")
    derivative: Float[Param, "..."] = param("", "its derivative gain", symbol="k_d")
    derivative_filter: Float[Param, "..."] = param("rad/s", "bandwidth of the filter of the derivative")
    rate_limit: Float[Param, "..."] = param("m/s, rad/s", "largest rate demanded for an error")
    integral_limit: Float[Param, "..."] = param("m/s^2, rad/s^2", "largest size of the integral")
    limit: Float[Param, "..."] = param("m/s^2, rad/s^2", "largest acceleration demanded")

    def __check_init__(self):
        gains, limits = ("outer", "inner", "derivative_filter"), ("rate_limit", "integral_limit", "limit")
        optional_gains = ("integral", "derivative")
        for name in gains:
            checks.positive(name, getattr(self, name))
        for name in optional_gains:
            checks.not_negative(name, getattr(self, name))
        for name in limits:
            checks.positive(name, getattr(self, name), finite=False)
        for name in (*gains, *optional_gains, *limits):
            checks.per_axis(name, getattr(self, name), len(self.model.coordinates.angles))

    def init_law(self, y: Measurement, r: Target) -> CascadeState:
        still = jnp.zeros_like(y.position)
        return CascadeState(still, still, jnp.zeros(()))

    def acceleration(self, state: CascadeState, y: Measurement, tracking_error: TrackingError):
        error = self._rate_error(tracking_error)
        step = jnp.where(state.elapsed > 0, state.elapsed, 1.0)
        slope = jnp.where(state.elapsed > 0, self._new(state) * (error - state.smooth) / step, 0.0)
        demanded = tracking_error.acceleration + self.inner * error + state.integral + self.derivative * slope
        return jnp.clip(demanded, -self.limit, self.limit), {"estimate": -state.integral}

    def update(
        self, state: CascadeState, y: Measurement, tracking_error: TrackingError, actuation: ActuationResult, dt
    ) -> CascadeState:
        """Anti-windup of the integral by back-calculation, with the time constant of `pid`."""
        error = self._rate_error(tracking_error)
        squared = self.integral * self.outer / self.inner
        rate = safe_sqrt(squared)
        back = jnp.minimum(rate, 1 / dt) * actuation.missing
        integral = state.integral + dt * (self.integral * error + back)
        smooth = jnp.where(state.elapsed > 0, state.smooth + self._new(state) * (error - state.smooth), error)
        return CascadeState(jnp.clip(integral, -self.integral_limit, self.integral_limit), smooth, dt)

    def signals(self):
        return ESTIMATE | ATTAINED_SHARE

    def _rate_error(self, tracking_error: TrackingError) -> PerAxis:
        return tracking_error.rate + jnp.clip(self.outer * tracking_error.error, -self.rate_limit, self.rate_limit)

    def _new(self, state: CascadeState) -> Float[Array, "..."]:
        """Share of the newest error in the filter of the derivative."""
        step = jnp.where(state.elapsed > 0, state.elapsed, 1.0)
        return -jnp.expm1(-self.derivative_filter * step)
