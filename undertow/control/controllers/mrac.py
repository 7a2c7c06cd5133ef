"""Model reference adaptive control (MRAC): the plant follows a reference model while parameters are adapted."""

from typing import NamedTuple

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from undertow.control.controllers.actuation import AbstractAccelerationLaw, Actuation, ActuationResult, actuation_for
from undertow.control.controllers.bandwidths import LoopTransfer, axes_of, best_frequency, scalar_if_uniform
from undertow.control.controllers.law_signals import ATTAINED_SHARE, ESTIMATE
from undertow.control.controllers.options import ActuationOptions, DesignConditions
from undertow.control.controllers.tracking_error import pole_placement
from undertow.core import checks
from undertow.core.contracts import Measurement, Model, Target, TrackingError
from undertow.core.errors import BadInput
from undertow.core.option_groups import flat_options
from undertow.core.param import Param, param
from undertow.core.signals import Signal

PerAxis = Float[Array, " n"]

_SLOPE = 0.5  # of the filtered error, over the frequency of the reference model
_ADAPTATION = 0.2  # over the square of the frequency
_UNLIMITED = 10.0  # m/s^2, rad/s^2, where actuators have no limit


class AdaptiveState(NamedTuple):
    """State of the law."""

    parameters: Float[Array, "n 4"]  # theta, m/s^2, rad/s^2
    error: PerAxis  # e_m, that of the reference model, m, rad
    rate: PerAxis  # m/s, rad/s
    begun: Float[Array, ""]  # 0 before the first measurement, then 1


class MRAC(AbstractAccelerationLaw):
    """a = a_n - theta^T Phi with a_n = a_d + w^2 e + 2 zeta w e_dot and Phi = (1, v, |v| v, a_n / A) for each axis.

    The reference model is e_m_ddot = -w^2 e_m - 2 zeta w e_m_dot from the same start, moved by what limits take away,
    so that limits teach nothing. With E = (e - e_m, e_dot - e_m_dot), A^T P + P A = -Q and s = b^T P E the parameters
    follow theta_dot = -gamma (Phi s + sigma |s| theta) within |theta| <= bound. With e-modification sigma = 0 and
    theta* constant V = 1/2 E^T P E + |theta - theta*|^2 / (2 gamma) falls as V_dot = -1/2 E^T Q E.

    P is the one with p_22 = 1, p_12 = c, p_11 = w^2 + 2 zeta w c: Q = diag(2 w^2 c, 4 zeta w - 2 c) and s = e_dot + c e
    of E. With the load as only parameter the law is a PID with k_d = 2 zeta w, k_p = w^2 + gamma and
    k_i = gamma c.

    Raises:
        BadInput: a number of the wrong sign, or a damping ratio of at most c / 2 w, for which Q is not positive.
    """

    model: Model
    actuation: Actuation
    frequency: Float[Param, "..."] = param(
        "rad/s", "natural frequency of the reference model", symbol="w", range=(0.1, 30.0)
    )
    damping: Float[Param, "..."] = param("", "damping ratio of the reference model", symbol="zeta", range=(0.3, 3.0))
    adaptation: Float[Param, "..."] = param("1/s^2", "rate of adaptation", symbol="gamma", range=(1e-3, 100.0))
    e_modification: Float[Param, "..."] = param("", "leakage per filtered error", symbol="sigma")
    bound: Float[Param, "..."] = param("m/s^2, rad/s^2", "largest size of a parameter", symbol="theta_max")
    scale: Float[Param, "..."] = param("m/s^2, rad/s^2", "scale of the nominal acceleration", symbol="A")
    filter_ratio: Float[Param, "..."] = param("", "slope c of the filtered error over w", symbol="c / w")

    def __check_init__(self):
        for name in ("frequency", "damping", "adaptation", "e_modification", "bound", "scale", "filter_ratio"):
            checks.per_axis(name, getattr(self, name), len(self.model.coordinates.angles))
        for name in ("frequency", "damping", "bound", "scale", "filter_ratio"):
            checks.positive(name, getattr(self, name))
        for name in ("adaptation", "e_modification"):
            checks.not_negative(name, getattr(self, name))
        enough = lambda damping, ratio: (damping > ratio / 2).all()
        if not checks.assumed(enough, self.damping, self.filter_ratio):
            least = float(np.max(self.filter_ratio)) / 2
            raise BadInput("damping", f"be more than {least:g}, half of `filter_ratio`", float(np.min(self.damping)))

    def init_law(self, y: Measurement, r: Target) -> AdaptiveState:
        still = jnp.zeros_like(y.position)
        return AdaptiveState(jnp.zeros((still.size, 4)), still, still, jnp.zeros(()))

    def acceleration(self, state: AdaptiveState, y: Measurement, tracking_error: TrackingError):
        nominal, basis = self._basis(y, tracking_error)
        adapted = (state.parameters * basis).sum(-1)
        model_error = jnp.where(state.begun > 0, tracking_error.error - state.error, 0.0)
        return nominal - adapted, {"estimate": adapted, "model_error": model_error}

    def update(
        self, state: AdaptiveState, y: Measurement, tracking_error: TrackingError, actuation: ActuationResult, dt
    ) -> AdaptiveState:
        """State one sampling time later; the reference model is sampled as a double integrator is.

        Where Phi is large, adaptation is slowed to gamma |Phi|^2 = zeta w / T: from twice that on Euler's method adds
        more energy to the oscillation of E and theta than the reference model takes away.
        """
        _, basis = self._basis(y, tracking_error)
        error = jnp.where(state.begun > 0, state.error, tracking_error.error)
        rate = jnp.where(state.begun > 0, state.rate, tracking_error.rate)
        filtered = tracking_error.rate - rate + self.filter_ratio * self.frequency * (tracking_error.error - error)
        filtered = filtered[:, None]
        share = jnp.broadcast_to(self.e_modification, tracking_error.error.shape)[:, None]
        gradient = basis * filtered + share * jnp.abs(filtered) * state.parameters
        speed = jnp.minimum(self.adaptation, self.damping * self.frequency / (dt * (basis**2).sum(-1)))[:, None]
        box = jnp.broadcast_to(self.bound, tracking_error.error.shape)[:, None]
        pull = -(self.frequency**2) * error - 2 * self.damping * self.frequency * rate - actuation.missing
        return AdaptiveState(
            parameters=jnp.clip(state.parameters - dt * speed * gradient, -box, box),
            error=error + dt * rate + dt**2 / 2 * pull,
            rate=rate + dt * pull,
            begun=jnp.ones(()),
        )

    def signals(self):
        behind = Signal(("axis",), "[axis]", "error of the reference model subtracted from the error")
        return ESTIMATE | {"model_error": behind} | ATTAINED_SHARE

    def _basis(self, y: Measurement, tracking_error: TrackingError) -> tuple[PerAxis, Float[Array, "n 4"]]:
        """Acceleration of the nominal law, and Phi."""
        nominal = pole_placement(tracking_error, self.frequency, self.damping)
        v = self.model.coordinates.velocity(y)
        return nominal, jnp.stack([jnp.ones_like(v), v, jnp.abs(v) * v, nominal / self.scale], -1)


@flat_options()
def mrac(
    model: Model,
    *,
    conditions: DesignConditions = DesignConditions(),
    frequency=None,
    damping=1.0,
    adaptation=None,
    e_modification=0.0,
    bound=None,
    scale=None,
    filter_ratio=_SLOPE,
    actuation: ActuationOptions = ActuationOptions(),
) -> MRAC:
    """Model reference adaptive control with projection: Lavretsky and Wise (2013), ch. 9 to 11. Body axes.

    A baseline law and parameters for a constant load, linear and quadratic drag and the effectiveness of the actuators
    of each axis. The reference model is moved by what limits take away, as in the pseudo-control hedging of Johnson
    and Calise (2000). Projection is onto a box.

    Args:
        model: nominal model, from `plant.model()`.
        frequency: natural frequency w of the reference model, rad/s; one number or one per axis. None: the one of least
            predicted cost that keeps the margins of `bandwidths.py` with the other defaults.
        damping: its damping ratio, more than half of `filter_ratio`.
        adaptation: gamma, 1/s^2; one number or one per axis. None: a fifth of w^2. 0 for the baseline law alone.
        e_modification: sigma: parameters decay by sigma |s|; 0 for none.
        bound: largest size of each parameter, m/s^2 and rad/s^2. None: the authority of the actuators, 10 where
            they have no limit.
        scale: A: the parameter of effectiveness is a share of this acceleration, m/s^2 and rad/s^2. None: twice
            the bound, so that half of the effectiveness may be missing.
        filter_ratio: slope c of the filtered error s = e_dot + c e over w: with a larger one, position teaches more
            than velocity.

    Raises:
        BadInput: a value is out of its range.
    """
    model = model.in_body_axes()
    axes = axes_of(model, conditions)
    if frequency is None:
        frequency = scalar_if_uniform([best_frequency(axis, _load_alone) for axis in axes])
    if bound is None:
        bound = scalar_if_uniform([axis.authority if np.isfinite(axis.authority) else _UNLIMITED for axis in axes])
    for name, value in (("frequency", frequency), ("bound", bound)):
        checks.per_axis(name, value, len(axes))
        checks.positive(name, value)
    return MRAC(
        model=model,
        actuation=actuation_for(conditions.sampling_time, frequency, actuation),
        frequency=frequency,
        damping=damping,
        adaptation=_ADAPTATION * jnp.asarray(frequency, dtype=float) ** 2 if adaptation is None else adaptation,
        e_modification=e_modification,
        bound=bound,
        scale=2 * jnp.asarray(bound, dtype=float) if scale is None else scale,
        filter_ratio=filter_ratio,
    )


def _load_alone(w, s) -> LoopTransfer:
    """The law with the default damping and adaptation, and the load as only parameter."""
    adaptation = _ADAPTATION * w**2
    return LoopTransfer(w**2 + adaptation + adaptation * _SLOPE * w / s, 2 * w + 0 * s)
