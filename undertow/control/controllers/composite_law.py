"""The paper's law: robust composite adaptive fuzzy control (RCAFC), and RAFC as its case gamma_eps = 0.

Eqs. (18)-(29), (39)-(44) and (61).
"""

from typing import NamedTuple

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Float

from undertow.control.controllers.law_signals import ADAPTIVE_LAW, lyapunov_signals, share_given, weight_signals
from undertow.control.controllers.robust_modification import RobustModification
from undertow.control.controllers.tracking_error import Tracking, check_gains, tracking
from undertow.control.estimation.fuzzy_system import FuzzySystem
from undertow.control.estimation.series_parallel import SeriesParallel
from undertow.core import checks
from undertow.core.contracts import (
    AbstractContinuousController,
    Measurement,
    Model,
    Target,
    forced_acceleration,
    input_for,
)
from undertow.core.errors import BadInput
from undertow.core.numerics.linear_algebra import companion_lyapunov
from undertow.core.numerics.smoothing import SWITCHES, switch
from undertow.core.param import Param, param
from undertow.core.signals import Signal


def projected_rate(
    value: Float[Array, "..."], rate: Float[Array, "..."], bound: Float[Array, "..."]
) -> Float[Array, "..."]:
    """`rate`, but zero where `value` is at +-bound and would leave.

    The removed part never points into the box, so the distance to any point inside falls at least as fast as without
    projection.
    """
    leaving = (jnp.abs(value) >= bound) & (value * rate > 0)
    return jnp.where(leaving, 0.0, rate)


PerAxis = Float[Array, " n"]

FUZZY_INPUTS = ("error", "state")
IDENTIFICATION_INPUTS = ("applied", "commanded")

_PER_AXIS = ("adaptation", "composite", "robust_gain", "layer", "weights_bound")
_PER_AXIS_IDENTIFICATION = ("pole", "compensation_gain", "compensation_layer")


_PREDICTED = {
    "predicted_position": Signal(("axis",), "[axis]", "position of the identification model"),
    "predicted_velocity": Signal(("axis",), "[axis]/s", "velocity of the identification model"),
}


class RCAFState(NamedTuple):
    """State z of the law."""

    predicted_position: PerAxis  # x_hat, m, rad
    predicted_velocity: PerAxis  # x_hat_dot, m/s, rad/s
    weights: Float[Array, "n rules"]  # theta, m/s^2, rad/s^2


class RCAF(AbstractContinuousController):
    """The paper's law. Gains are one number for all axes or one per axis; `feedback` (2,) or (n, 2), `weight` likewise.

    Raises:
        BadInput: a gain of the wrong sign, feedback not Hurwitz, weight not positive definite, or a fuzzy
            system whose number of inputs does not fit `fuzzy_input`.
    """

    model: Model
    fuzzy: FuzzySystem
    identification: SeriesParallel
    feedback: Float[Param, "*#n 2"] = param(
        "1/s^2, 1/s", "state feedback", symbol="K", default=(1.0, 2.0), source="Table 1"
    )
    weight: Float[Param, "*#n 2 2"] = param(
        "", "weight of Eq. (21)", symbol="Q", default=((10.0, 0.0), (0.0, 10.0)), source="Table 1"
    )
    adaptation: Float[Param, "..."] = param("1/s^2", "adaptation gain", symbol="gamma", default=100.0, source="Table 1")
    composite: Float[Param, "..."] = param(
        "", "share of the modelling error; 0 is RAFC, Eq. (61)", symbol="gamma_eps", default=500.0, source="Table 1"
    )
    robust_gain: Float[Param, "..."] = param(
        "m/s^2, rad/s^2", "amplitude of the robust term", symbol="w_bar", default=10.0, source="Table 1"
    )
    layer: Float[Param, "..."] = param(
        "unit of s", "boundary layer of the robust term", symbol="phi", default=0.5, source="Table 1"
    )
    weights_bound: Float[Param, "..."] = param(
        "m/s^2, rad/s^2", "largest size of a weight", symbol="theta_max", default=jnp.inf
    )
    modification: RobustModification | None = None
    switching: str = eqx.field(static=True, default="tanh")
    identification_input: str = eqx.field(static=True, default="applied")
    fuzzy_input: str = eqx.field(static=True, default="error")
    method: str = eqx.field(static=True, default="euler")
    substeps: int = eqx.field(static=True, default=1)

    def __check_init__(self):
        for name in ("adaptation", "composite", "robust_gain"):
            checks.not_negative(name, getattr(self, name))
        checks.positive("layer", self.layer)
        checks.positive("weights_bound", self.weights_bound, finite=False)
        checks.choice("switching", self.switching, SWITCHES)
        checks.choice("fuzzy_input", self.fuzzy_input, FUZZY_INPUTS)
        checks.choice("identification_input", self.identification_input, IDENTIFICATION_INPUTS)
        if self.fuzzy.inputs != 1 + FUZZY_INPUTS.index(self.fuzzy_input):
            raise BadInput("fuzzy", f"have the inputs of `{self.fuzzy_input}`", f"of {self.fuzzy.inputs} input(s)")
        axes = len(self.model.coordinates.angles)
        for name in _PER_AXIS_IDENTIFICATION:
            checks.per_axis(name, getattr(self.identification, name), axes)
        if self.modification is not None:
            for name in ("leakage", "e_modification", "dead_zone"):
                checks.per_axis(name, getattr(self.modification, name), axes)
        check_gains(self.feedback, self.weight, {name: getattr(self, name) for name in _PER_AXIS}, axes)

    def init(self, y: Measurement, r: Target) -> RCAFState:
        axes = y.position.shape[0]
        return RCAFState(y.position, self.model.coordinates.velocity(y), jnp.zeros((axes, self.fuzzy.rules)))

    def command(self, z: RCAFState, y: Measurement, r: Target):
        """V of Eq. (23), with d_hat of Eq. (42) and u_r of Eq. (43); of a non-affine model, the solution V of
        g(x, V) = the acceleration that Eq. (23) gives by G.
        """
        dynamics, coordinates, _ = self.model
        tracking_error = self._tracking(y, r)
        eps = self.identification.error(z.predicted_velocity, coordinates.velocity(y))
        d_hat = self.fuzzy.output(z.weights, self._basis(eps, y))
        u_r = self.robust_gain * switch(tracking_error.filtered, self.layer, self.switching)
        desired = (
            -dynamics.drift(y) - d_hat + tracking_error.feedback(self.feedback) + tracking_error.acceleration + u_r
        )
        u = input_for(dynamics, y, desired)
        signals = {
            "estimate": d_hat,
            "robust_term": u_r,
            "modelling_error": eps,
            "predicted_position": z.predicted_position,
            "predicted_velocity": z.predicted_velocity,
            "attained_share": share_given(desired, forced_acceleration(dynamics, y, u)),
        }
        signals |= lyapunov_signals(tracking_error, self.lyapunov(), self.weight)
        return u, signals | weight_signals(z.weights, self.weights_bound)

    def flow(self, z: RCAFState, y: Measurement, r: Target, u_applied) -> RCAFState:
        """Identification model, Eq. (32), and composite adaptive law, Eq. (44)."""
        dynamics, coordinates, _ = self.model
        s = self._tracking(y, r).filtered
        eps = self.identification.error(z.predicted_velocity, coordinates.velocity(y))
        xi = self._basis(eps, y)
        d_hat = self.fuzzy.output(z.weights, xi)
        u = u_applied if self.identification_input == "applied" else self.command(z, y, r)[0]
        modelled = dynamics.drift(y) + forced_acceleration(dynamics, y, u)
        theta_rate = -(self.adaptation * (s + self.composite * eps))[:, None] * xi
        if self.modification is not None:
            theta_rate = self.modification.rate(theta_rate, self.adaptation, eps, z.weights)
        return RCAFState(
            predicted_position=z.predicted_velocity,
            predicted_velocity=self.identification.acceleration(eps, modelled, d_hat),
            weights=projected_rate(z.weights, theta_rate, self._box()),
        )

    def project(self, z: RCAFState) -> RCAFState:
        """Weights projected into their box: |d_hat| stays below `weights_bound`, and weights cannot drift away."""
        return z._replace(weights=jnp.clip(z.weights, -self._box(), self._box()))

    def signals(self):
        return ADAPTIVE_LAW | _PREDICTED

    def lyapunov(self) -> Float[Array, "*#n 2 2"]:
        """P of Eq. (21)."""
        return companion_lyapunov(self.feedback, self.weight)

    def _box(self) -> Float[Array, "..."]:
        """theta_max, shaped to broadcast with theta."""
        return self.weights_bound if self.weights_bound.ndim == 0 else self.weights_bound[:, None]

    def _tracking(self, y: Measurement, r: Target) -> Tracking:
        return tracking(self.model.coordinates, self.lyapunov(), y, r)

    def _basis(self, eps: PerAxis, y: Measurement) -> Float[Array, "n rules"]:
        """xi of the chosen input: eps (the paper's), or (x_i, x_i_dot) (for the comparison of Table 2)."""
        inputs = eps[:, None] if self.fuzzy_input == "error" else jnp.stack([y.position, y.velocity], -1)
        return self.fuzzy.basis(inputs)
