"""Adaptive backstepping with tuning functions, through the lag of the actuators."""

from typing import Any, NamedTuple

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from undertow.control.controllers.actuation import AbstractAccelerationLaw, Actuation, ActuationResult, actuation_for
from undertow.control.controllers.bandwidths import Axis, LoopTransfer, axes_of, best_frequency, scalar_if_uniform
from undertow.control.controllers.law_signals import ATTAINED_SHARE, ESTIMATE
from undertow.control.controllers.options import ActuationOptions, DesignConditions
from undertow.core import checks
from undertow.core.contracts import Measurement, Model, Target, TrackingError
from undertow.core.option_groups import flat_options
from undertow.core.param import Param, param

PerAxis = Float[Array, " n"]

_INNER, _ADAPTATION = 4.0, 0.3  # over the rate, and over its square
_SHORT = 8.0  # sampling times: with a shorter lag the margins leave more to the law without the third step
_WHOLE = 0.999  # an attained share below this means that limits bind
_UNLIMITED = 10.0  # m/s^2, rad/s^2, where actuators have no limit


class BacksteppingState(NamedTuple):
    """State of the law, m/s^2 and rad/s^2."""

    load: PerAxis  # estimate
    acceleration: PerAxis  # that the actuators give, from their nominal lag


class Steps(NamedTuple):
    """Errors of the three steps, and what follows from them."""

    second: Any  # z_2
    third: Any  # z_3
    learning: Any  # rate of the estimate
    demand: Any


class AdaptiveBackstepping(AbstractAccelerationLaw):
    """Krstic's design with tuning functions for e_ddot = a_d - x - d, tau x_dot = a - x and a constant load d.

    z_1 = e, z_2 = e_dot + c z_1, alpha = a_d + c e_dot + c^2 z_1 + c z_2 - d_hat, z_3 = alpha - x. The last tuning
    function is d_hat_dot = -gamma (z_2 + 2 z_3 / c), and a such that z_3_dot = -c_3 z_3 - c^2 z_2 - 2 c (d - d_hat):
    V = 1/2 (c^2 z_1^2 + z_2^2 + z_3^2 / c^2) + (d - d_hat)^2 / (2 gamma) falls as
    V_dot = -c^3 z_1^2 - c z_2^2 - c_3 z_3^2 / c^2. The jerk of the reference is not known to the law, and left out.

    Without lag the third step falls away, a = alpha, and the law is a PID with k_d = 2 c, k_p = 2 c^2 + gamma and
    k_i = gamma c. While limits of the actuators bind, the estimate waits, and it never learns from errors that no input
    moves; projection keeps it within its bound.

    Raises:
        BadInput: a number that is not positive, or a negative rate of adaptation or lag.
    """

    model: Model
    actuation: Actuation
    rate: Float[Param, "..."] = param("1/s", "rate of decay of the first two steps", symbol="c", range=(0.1, 30.0))
    inner_rate: Float[Param, "..."] = param("1/s", "rate of the third step", symbol="c_3", range=(0.1, 60.0))
    adaptation: Float[Param, "..."] = param("1/s^2", "rate of adaptation", symbol="gamma", range=(1e-3, 100.0))
    bound: Float[Param, "..."] = param("m/s^2, rad/s^2", "largest estimate of the load", symbol="d_max")
    lag: Float[Param, ""] = param("s", "nominal time constant of the actuators", symbol="tau")
    lagged: bool = eqx.field(static=True, default=True)

    def __check_init__(self):
        for name in ("rate", "inner_rate", "adaptation", "bound"):
            checks.per_axis(name, getattr(self, name), len(self.model.coordinates.angles))
        for name in ("rate", "inner_rate", "bound"):
            checks.positive(name, getattr(self, name))
        checks.not_negative("adaptation", self.adaptation, "1/s^2")
        checks.not_negative("lag", self.lag, "s")

    def init_law(self, y: Measurement, r: Target) -> BacksteppingState:
        still = jnp.zeros_like(y.position)
        return BacksteppingState(still, still)

    def acceleration(self, state: BacksteppingState, y: Measurement, tracking_error: TrackingError):
        return self._steps(state, tracking_error).demand, {"estimate": state.load}

    def update(
        self, state: BacksteppingState, y: Measurement, tracking_error: TrackingError, actuation: ActuationResult, dt
    ) -> BacksteppingState:
        errors = self._steps(state, tracking_error)
        learning = jnp.where(actuation.share < _WHOLE, 0.0, self._within_reach(y, errors.learning))
        step_share = -jnp.expm1(-dt / self.lag) if self.lagged else 1.0
        return BacksteppingState(
            jnp.clip(state.load + dt * learning, -self.bound, self.bound),
            state.acceleration + step_share * (errors.demand + actuation.missing - state.acceleration),
        )

    def signals(self):
        return ESTIMATE | ATTAINED_SHARE

    def _steps(self, state: BacksteppingState, tracking_error: TrackingError) -> Steps:
        gains = (self.rate, self.inner_rate, self.adaptation, self.lag if self.lagged else None)
        return steps(*tracking_error, state.load, state.acceleration, *gains)


def steps(error, rate, acceleration, load, actuator_acceleration, c, inner, adaptation, lag) -> Steps:
    """The three steps; two of them where `lag` is None.

    Args:
        error: e, m, rad.
        rate: e_dot, m/s, rad/s.
        acceleration: of the target, m/s^2, rad/s^2.
        load: estimate, m/s^2, rad/s^2.
        actuator_acceleration: acceleration x that the actuators give, m/s^2, rad/s^2.
        c: rate of the first two steps, 1/s.
        inner: rate of the third, 1/s.
        adaptation: gamma, 1/s^2.
        lag: of the actuators, s.
    """
    second = rate + c * error
    alpha = acceleration + c * rate + c**2 * error + c * second - load
    if lag is None:
        return Steps(second, 0 * second, -adaptation * second, alpha)
    third = alpha - actuator_acceleration
    learning = -adaptation * (second + 2 / c * third)
    of_alpha = (
        2 * c * (acceleration - actuator_acceleration - load) + 2 * c**2 * rate - learning
    )  # its rate, but for d - d_hat
    return Steps(second, third, learning, actuator_acceleration + lag * (inner * third + c**2 * second + of_alpha))


@flat_options("motor", "actuator_rate")
def adaptive_backstepping(
    model: Model,
    *,
    conditions: DesignConditions = DesignConditions(),
    rate=None,
    inner_rate=None,
    adaptation=None,
    bound=None,
    lag: float | None = None,
    actuation: ActuationOptions = ActuationOptions(),
) -> AdaptiveBackstepping:
    """Adaptive backstepping with tuning functions: Krstic, Kanellakopoulos and Kokotovic (1995), ch. 4. Body axes.

    Each axis is a double integrator with an unknown constant load, behind the nominal lag of the actuators.

    Args:
        model: nominal model, from `plant.model()`.
        rate: c, rate of the first two steps, 1/s; one number or one per axis. None: the one of least predicted cost
            that keeps the margins of `bandwidths.py` with the other defaults.
        inner_rate: c_3, rate of the third step, 1/s. None: four times c.
        adaptation: gamma, 1/s^2. None: 0.3 c^2. 0 for none.
        bound: largest estimate of the load, m/s^2 and rad/s^2. None: the authority of the actuators, 10 where
            they have no limit.
        lag: nominal time constant of the actuators, s; None: that of the model. The third step falls away where it is
            less than eight sampling times: there the margins leave more to the law without it.
        reference_frequency: that of the filter of reference jumps, rad/s; None: half of c, 2 at most; 0 for no filter.

    Raises:
        BadInput: a value is out of its range.
    """
    model = model.in_body_axes()
    axes = axes_of(model, conditions)
    actuator_lag = (axes[0].lag or 0.0) if lag is None else lag
    checks.not_negative("lag", actuator_lag, "s")
    lagged = actuator_lag >= _SHORT * conditions.sampling_time
    if rate is None:
        rate = scalar_if_uniform([backstepping_rate(axis, actuator_lag if lagged else None) for axis in axes])
    if bound is None:
        bound = scalar_if_uniform([axis.authority if np.isfinite(axis.authority) else _UNLIMITED for axis in axes])
    checks.per_axis("rate", rate, len(axes))
    checks.positive("rate", rate)
    c = jnp.asarray(rate, dtype=float)
    return AdaptiveBackstepping(
        model=model,
        actuation=actuation_for(conditions.sampling_time, rate, actuation),
        rate=rate,
        inner_rate=_INNER * c if inner_rate is None else inner_rate,
        adaptation=_ADAPTATION * c**2 if adaptation is None else adaptation,
        bound=bound,
        lag=actuator_lag,
        lagged=lagged,
    )


def backstepping_rate(axis: Axis, lag: float | None) -> float:
    """Rate c of the law with its other defaults, by the rule of `bandwidths.py`, 1/s."""

    def law(c, s):
        decay = np.exp(-axis.sampling_time / lag) if lag else 0.0
        adaptation = _ADAPTATION * c**2

        def demand(error, rate, actuator_acceleration):
            # The estimate integrates its own effect on the errors: learning is affine in it.
            steps_with = lambda load: steps(
                error, rate, 0.0, load, actuator_acceleration, c, _INNER * c, adaptation, lag
            )
            learning = steps_with(0.0).learning
            return steps_with(learning / (s - (steps_with(1.0).learning - learning))).demand

        inner = 1 - demand(0.0, 0.0, 1.0) * (1 - decay) / (np.exp(s * axis.sampling_time) - decay) if lag else 1.0
        return LoopTransfer(demand(1.0, 0.0, 0.0) / inner, demand(0.0, 1.0, 0.0) / inner)

    return best_frequency(axis, law)
