"""Linear-quadratic regulator with an integral (LQI), with the lag of the actuators in its model."""

import functools
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from undertow.control.controllers.actuation import AbstractAccelerationLaw, Actuation, ActuationResult, actuation_for
from undertow.control.controllers.bandwidths import (
    Axis,
    LoopTransfer,
    axes_of,
    bandwidth_grid,
    best_frequency,
    scalar_if_uniform,
)
from undertow.control.controllers.law_signals import ATTAINED_SHARE, ESTIMATE
from undertow.control.controllers.options import ActuationOptions, DesignConditions
from undertow.core import checks
from undertow.core.arrays import in_numbers
from undertow.core.contracts import Measurement, Model, Target, TrackingError
from undertow.core.kept_programs import kept_program
from undertow.core.numerics.riccati import regulator_gain
from undertow.core.option_groups import flat_options
from undertow.core.param import Param, param

PerAxis = Float[Array, " n"]

_LEAST_LAG = 1e-12  # s
_INTEGRAL, _RATE = 0.1, 1.0  # weights


class LQIState(NamedTuple):
    """State of the law, m/s^2 and rad/s^2."""

    integral: PerAxis
    acceleration: PerAxis  # that the actuators give, from their nominal lag


class LQI(AbstractAccelerationLaw):
    """a = a_d + K_e e + K_v e_dot + K_q integral of e - K_a (a_given - a_d), gains of the discrete Riccati equation.

    One axis is x_ddot = a_given + load, tau a_given_dot + a_given = a, sampled with a held. The gains minimise the sum
    of (rho w^3 q)^2 + (w^2 e)^2 + (sigma w e_dot)^2 + a^2, with q the integral of e. Without lag and for a short
    sampling time they are K_q = rho w^3, K_v^2 = 2 K_e + (sigma w)^2 and K_e^2 = w^4 + 2 K_q K_v.

    Raises:
        BadInput: a number of the wrong sign.
    """

    model: Model
    actuation: Actuation
    frequency: Float[Param, "..."] = param(
        "rad/s", "frequency at which an error costs as much as the input", symbol="w", range=(0.1, 30.0)
    )
    integral_weight: Float[Param, "..."] = param("", "weight of the integral", symbol="rho", range=(0.01, 1.0))
    rate_weight: Float[Param, "..."] = param("", "weight of the rate of the error", symbol="sigma", range=(0.1, 10.0))
    lag: Float[Param, ""] = param("s", "nominal time constant of the actuators", symbol="tau")
    sampling_time: Float[Param, ""] = param("s", "sampling time of the design", symbol="T")
    gains: Float[Param, "*#n 4"] = param(
        "1/s^3, 1/s^2, 1/s, -", "gains on integral, error, rate and given acceleration", symbol="K"
    )

    def __check_init__(self):
        for name in ("frequency", "integral_weight", "rate_weight"):
            checks.per_axis(name, getattr(self, name), len(self.model.coordinates.angles))
            checks.positive(name, getattr(self, name))
        checks.not_negative("lag", self.lag, "s")
        checks.positive("sampling_time", self.sampling_time, "s")

    def init_law(self, y: Measurement, r: Target) -> LQIState:
        return LQIState(jnp.zeros_like(y.position), jnp.zeros_like(y.position))

    def acceleration(self, state: LQIState, y: Measurement, tracking_error: TrackingError):
        error, rate, acceleration = tracking_error
        _, of_error, of_rate, of_acceleration = jnp.moveaxis(self.gains, -1, 0)
        demanded = acceleration + of_error * error + of_rate * rate + state.integral
        demanded = demanded - of_acceleration * (state.acceleration - acceleration)
        return demanded, {"estimate": -state.integral / (1 + of_acceleration)}

    def update(
        self, state: LQIState, y: Measurement, tracking_error: TrackingError, actuation: ActuationResult, dt
    ) -> LQIState:
        """State one sampling time later; what limits take away is given back to the integral, as in `pid`."""
        of_integral, _, of_rate, _ = jnp.moveaxis(self.gains, -1, 0)
        back_calculation = jnp.minimum(jnp.sqrt(of_integral / of_rate), 1 / dt) * actuation.missing
        demanded, _ = self.acceleration(state, y, tracking_error)
        lag_share = -jnp.expm1(-dt / jnp.maximum(self.lag, _LEAST_LAG))
        return LQIState(
            state.integral + dt * (of_integral * tracking_error.error + back_calculation),
            state.acceleration + lag_share * (demanded + actuation.missing - state.acceleration),
        )

    def signals(self):
        return ESTIMATE | ATTAINED_SHARE


def lqi_gains(frequency, integral_weight, rate_weight, lag, dt) -> Float[Array, "4"]:
    """Gains on the integral (1/s^3), error (1/s^2), its rate (1/s) and the given acceleration, of one axis."""
    decay = jnp.exp(-dt / jnp.maximum(lag, _LEAST_LAG))
    decayed_time = lag * (1 - decay)  # integral of the decaying part, and the integral of that
    drift = lag * (dt - decayed_time)
    zero, one = jnp.zeros_like(dt), jnp.ones_like(dt)
    # State: integral, error, rate of the error, given acceleration; the last one lowers the rate.
    transition = jnp.stack(
        [
            jnp.stack([one, dt, zero, zero]),
            jnp.stack([zero, one, dt, -drift]),
            jnp.stack([zero, zero, one, -decayed_time]),
            jnp.stack([zero, zero, zero, decay]),
        ]
    )
    entry = jnp.stack([zero, -(dt**2 / 2 - drift), -(dt - decayed_time), 1 - decay])
    weight = jnp.stack([integral_weight * frequency**3, frequency**2, rate_weight * frequency, zero]) ** 2
    gain = regulator_gain(transition, entry, jnp.diag(weight))
    return gain * jnp.asarray([-1.0, -1.0, -1.0, 1.0])


@kept_program
def _gains_of_axes(frequency, integral_weight, rate_weight, lag, dt) -> Float[Array, "k 4"]:
    frequency, integral_weight, rate_weight = jnp.broadcast_arrays(frequency, integral_weight, rate_weight)
    return jax.vmap(lqi_gains, (0, 0, 0, None, None))(frequency, integral_weight, rate_weight, lag, dt)


@functools.lru_cache(maxsize=1024)
def lqi_frequency(axis: Axis, integral_weight: float, rate_weight: float, lag: float) -> float:
    """Frequency w of the law with these weights, designed for this lag (s), by the rule of `bandwidths.py`, rad/s."""
    dt = axis.sampling_time
    with in_numbers():
        numbers = (jnp.asarray(value, dtype=float) for value in (integral_weight, rate_weight, lag, dt))
        gains = np.asarray(_gains_of_axes(jnp.asarray(bandwidth_grid(axis), dtype=float), *numbers))

    def law(_, s):
        decay = np.exp(-dt / max(lag, _LEAST_LAG))
        of_integral, of_error, of_rate, of_acceleration = (column[:, None] for column in gains.T)
        inner = 1 + of_acceleration * (1 - decay) / (np.exp(s * dt) - decay)
        return LoopTransfer((of_error + of_integral / s) / inner, of_rate / inner)

    return best_frequency(axis, law)


@flat_options("motor", "actuator_rate")
def lqi(
    model: Model,
    *,
    conditions: DesignConditions = DesignConditions(),
    frequency=None,
    integral_weight=_INTEGRAL,
    rate_weight=_RATE,
    lag: float | None = None,
    actuation: ActuationOptions = ActuationOptions(),
) -> LQI:
    """Linear-quadratic regulator with an integral, about trim: Anderson and Moore (1990). Body axes.

    The model of an axis is a double integrator behind the nominal lag of the actuators; weight, buoyancy and drag are
    compensated, so that it is the same at every trim. Couplings between axes are those that the inverse of the model
    leaves.

    Args:
        model: nominal model, from `plant.model()`.
        frequency: w, at which an error costs as much as the input, rad/s; one number or one per axis. None: the one of
            least predicted cost that keeps the margins of `bandwidths.py`.
        integral_weight: rho, weight of the integral of the error relative to w^3.
        rate_weight: sigma, weight of its rate relative to w.
        lag: nominal time constant of the actuators, s; None: that of the model. 0 for a double integrator alone.
        reference_frequency: that of the filter of reference jumps, rad/s; None: half of w, 2 at most; 0 for no filter.

    Raises:
        BadInput: a value is out of its range.
    """
    model = model.in_body_axes()
    axes = axes_of(model, conditions)
    actuator_lag = (axes[0].lag or 0.0) if lag is None else lag
    if frequency is None:
        weights_and_lag = ((integral_weight, _INTEGRAL), (rate_weight, _RATE), (actuator_lag, 0.0))
        nominal = [float(np.max(value)) if checks.known(value) else usual for value, usual in weights_and_lag]
        frequency = scalar_if_uniform([lqi_frequency(axis, *nominal) for axis in axes])
    for name, value in (("frequency", frequency), ("integral_weight", integral_weight), ("rate_weight", rate_weight)):
        checks.per_axis(name, value, len(axes))
        checks.positive(name, value)
    checks.not_negative("lag", actuator_lag, "s")
    numbers = (jnp.asarray(value, dtype=float) for value in (frequency, integral_weight, rate_weight))
    rows = jnp.broadcast_arrays(jnp.zeros(len(axes)), *numbers)[1:]
    times = (jnp.asarray(value, dtype=float) for value in (actuator_lag, conditions.sampling_time))
    gains = _gains_of_axes(*rows, *times)
    return LQI(
        model=model,
        actuation=actuation_for(conditions.sampling_time, frequency, actuation),
        frequency=frequency,
        integral_weight=integral_weight,
        rate_weight=rate_weight,
        lag=actuator_lag,
        sampling_time=conditions.sampling_time,
        gains=gains,
    )
