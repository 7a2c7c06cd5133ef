"""PID control as marine engineers design it: the baseline of comparisons."""

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from undertow.control.controllers.actuation import AbstractAccelerationLaw, Actuation, ActuationResult, actuation_for
from undertow.control.controllers.bandwidths import axes_of, pid_frequency, scalar_if_uniform
from undertow.control.controllers.law_signals import ATTAINED_SHARE, ESTIMATE
from undertow.control.controllers.options import ActuationOptions, DesignConditions
from undertow.core import checks
from undertow.core.contracts import Measurement, Model, Target, TrackingError
from undertow.core.errors import BadInput
from undertow.core.option_groups import flat_options
from undertow.core.param import Param, param

PerAxis = Float[Array, " n"]


class PID(AbstractAccelerationLaw):
    """a = a_d + k_p e + k_d e_dot + integral of k_i e, in the model's own axes; forces within limits; no windup.

    The state of the law is the acceleration of the integral, m/s^2 and rad/s^2.

    Raises:
        BadInput: a gain of the wrong sign, or an integral too strong for a stable loop: k_i < k_p k_d (Routh).
    """

    model: Model
    actuation: Actuation
    proportional: Float[Param, "..."] = param("1/s^2", "acceleration per error", symbol="k_p")
    integral: Float[Param, "..."] = param("1/s^3", "rate of the acceleration per error", symbol="k_i")
    derivative: Float[Param, "..."] = param("1/s", "acceleration per error of the rates", symbol="k_d")

    def __check_init__(self):
        checks.not_negative("integral", self.integral, "1/s^3")
        for name in ("proportional", "derivative"):
            checks.positive(name, getattr(self, name))
        for name in ("proportional", "integral", "derivative"):
            checks.per_axis(name, getattr(self, name), len(self.model.coordinates.angles))
        most = self.proportional * self.derivative
        if not checks.assumed(lambda gain, most: (gain < most).all(), self.integral, most):
            worst = np.asarray(self.integral / most).max()
            raise BadInput("integral", "be less than proportional times derivative", f"{worst:g} times that")

    def init_law(self, y: Measurement, r: Target) -> PerAxis:
        return jnp.zeros_like(y.position)

    def acceleration(self, state: PerAxis, y: Measurement, tracking_error: TrackingError):
        error, rate, acceleration = tracking_error
        demanded = acceleration + self.proportional * error + self.derivative * rate + state
        return demanded, {"estimate": -state}

    def update(
        self, state: PerAxis, y: Measurement, tracking_error: TrackingError, actuation: ActuationResult, dt
    ) -> PerAxis:
        """Anti-windup of the integral by back-calculation, Astrom and Murray (2008), 10.4.

        Its time constant is the geometric mean of those of integral and derivative, or one step where that is longer.
        """
        back = jnp.minimum(jnp.sqrt(self.integral / self.derivative), 1 / dt) * actuation.missing
        return state + dt * (self.integral * tracking_error.error + back)

    def signals(self):
        return ESTIMATE | ATTAINED_SHARE


def _check_routh(proportional, integral, derivative) -> None:
    """Raise where the loop would be unstable even on axes without lag, by the name of the option that says so."""
    if not checks.assumed(lambda k_i, most: (k_i < most).all(), integral, proportional * derivative):
        must = "have k_i below k_p k_d, or no axis is stable (Routh and Hurwitz)"
        worst = int(np.argmax(np.ravel(integral / (proportional * derivative))))
        k_p, k_i, k_d = (float(np.ravel(gain)[worst]) for gain in (proportional, integral, derivative))
        raise BadInput("gains", must, f"k_i = {k_i:g}, with k_p k_d = {k_p * k_d:g}")


@flat_options()
def pid(
    model: Model,
    *,
    conditions: DesignConditions = DesignConditions(),
    frequency=None,
    damping=1.0,
    integral_share=0.1,
    gains=None,
    actuation: ActuationOptions = ActuationOptions(),
) -> PID:
    """PID with acceleration as output, by pole placement, Fossen (2021), ch. 15. Body axes and quaternions.

    Args:
        model: nominal model, from `plant.model()`.
        sampling_time: that of the loop, s; a scenario sets it. From Python, give the `dt` of `simulate`: gains for a
            shorter one track more closely, but with less margin and more chattering than the rule allows.
        frequency: natural frequency w of the closed loop without its integral, rad/s; one number or one per axis. None:
            as in preset `robust`, the one of least predicted cost that keeps the margins of `bandwidths.py`.
        damping: damping ratio of the closed loop without its integral.
        integral_share: k_i = share w k_p with k_p = w^2; a tenth is Fossen's. 0 for PD.
        gains: (k_p, k_i, k_d) instead of these three, 1/s^2, 1/s^3 and 1/s; one triple or one per axis.

    Raises:
        BadInput: a value is out of its range.
    """
    checks.positive("sampling_time", conditions.sampling_time, "s")
    model = model.in_body_axes()
    if gains is None:
        if frequency is None:
            axes = axes_of(model, conditions)
            frequency = scalar_if_uniform([pid_frequency(axis) for axis in axes])
        for name, value, check in (
            ("frequency", frequency, checks.positive),
            ("damping", damping, checks.positive),
            ("integral_share", integral_share, checks.not_negative),
        ):
            checks.per_axis(name, value, len(model.coordinates.angles))
            check(name, value)
        w, zeta, share = (jnp.asarray(value, dtype=float) for value in (frequency, damping, integral_share))
        proportional, integral, derivative = w**2, share * w**3, 2 * zeta * w
    else:
        checks.per_axis("gains", gains, len(model.coordinates.angles), (3,))
        proportional, integral, derivative = jnp.moveaxis(jnp.asarray(gains, dtype=float), -1, 0)
        _check_routh(proportional, integral, derivative)
    return PID(
        model=model,
        actuation=actuation_for(conditions.sampling_time, jnp.sqrt(proportional), actuation),
        proportional=proportional,
        integral=integral,
        derivative=derivative,
    )
