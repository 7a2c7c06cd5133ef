"""The adaptive law of Slotine and Li: passivity, with the full regressor of the nominal model."""

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from undertow.control.controllers.actuation import AbstractAccelerationLaw, Actuation, ActuationResult, actuation_for
from undertow.control.controllers.bandwidths import LoopTransfer, axes_of, best_frequency, scalar_if_uniform
from undertow.control.controllers.law_signals import ATTAINED_SHARE, ESTIMATE
from undertow.control.controllers.options import ActuationOptions, DesignConditions
from undertow.core import checks
from undertow.core.contracts import AbstractDynamics, Measurement, Model, Outputs, Target, TrackingError
from undertow.core.option_groups import flat_options
from undertow.core.param import Param, param
from undertow.core.parametric_dynamics import AbstractParametricDynamics, Parameters, Parametrization
from undertow.core.signals import Signal

PerAxis = Float[Array, " n"]

# An attained share below this means that limits bind; above it the difference from 1 is rounding.
_WHOLE = 0.999
_ADAPTATION = 0.1  # over the square of the slope
_HALF, _FAR = 0.5, 1e6  # largest error: share of the authority that it asks for; m, rad
_USUAL = 10.0  # m/s^2, rad/s^2: at this acceleration the factors of other dynamics are learnt as fast as a load

_CHANGE = Signal((), "1", "largest change of a parameter, as a share of the plausible one: 1 where projection acts")


class DiagonalDynamics(AbstractParametricDynamics):
    """Any dynamics with three parameters per axis: factors of inertia and drift, and a constant load (m/s^2)."""

    dynamics: AbstractDynamics
    axes: int = eqx.field(static=True)

    def drift(self, y: Measurement) -> Outputs:
        return self.dynamics.drift(y)

    def gain(self, y: Measurement):
        return self.dynamics.gain(y)

    def invert(self, y: Measurement, acceleration: Outputs):
        return self.dynamics.invert(y, acceleration)

    def parametrization(self) -> Parametrization:
        ones = jnp.ones(self.axes)
        return Parametrization(
            nominal=jnp.concatenate([ones, ones, 0 * ones]),
            most=jnp.concatenate([0.8 * ones, 0.8 * ones, _USUAL**2 * ones]),
            rates=jnp.concatenate([ones / _USUAL**2, ones / _USUAL**2, ones]),
            inertia=ones,
        )

    def generalized_force(self, y: Measurement, parameters: Parameters, velocity, acceleration) -> Outputs:
        inertia, drift, load = jnp.split(parameters, 3)
        return inertia * acceleration - drift * self.dynamics.drift(y) + load

    def accelerated_by(self, y: Measurement, force: Outputs) -> Outputs:
        return force


class SlotineLi(AbstractAccelerationLaw):
    """force = Y(y, v_r, v_r_dot) theta + k I s, theta_dot = gamma Gamma Y^T s, s = e_dot + l e, v_r = v + s.

    I is the nominal inertia of each axis and Gamma the relative rates of the parametrization. With exact regressor and
    constant parameters V = 1/2 s^T M s + 1/2 (theta - theta*)^T (gamma Gamma)^-1 (theta - theta*) falls as
    V_dot = -k s^T I s. Parameters stay within plausible deviations from the nominal ones by projection, which can only
    lower V, and wait while limits of the actuators bind.

    Errors beyond `reach` count as that far: without it the velocity v_r, and with it the modelled forces, would grow
    without bound while limits keep the vehicle away.

    For small errors, with the load as only parameter, it is a PID with k_d = l + k, k_p = k l + gamma, k_i = gamma l.
    The state of the law are the parameters theta.

    Raises:
        BadInput: a number that is not positive, or a negative rate of adaptation.
    """

    model: Model
    actuation: Actuation
    regressor: AbstractParametricDynamics
    slope: Float[Param, "..."] = param("1/s", "rate of decay on the surface", symbol="l", range=(0.1, 30.0))
    gain: Float[Param, "..."] = param("1/s", "rate of decay of s", symbol="k", range=(0.1, 30.0))
    adaptation_rate: Float[Param, "..."] = param(
        "1/s^2", "rate of adaptation; one number or one per parameter", symbol="gamma", range=(1e-3, 100.0)
    )
    reach: Float[Param, "..."] = param("m, rad", "largest error that counts", symbol="e_max")

    def __check_init__(self):
        for name in ("slope", "gain", "reach"):
            checks.per_axis(name, getattr(self, name), len(self.model.coordinates.angles))
            checks.positive(name, getattr(self, name))
        checks.not_negative("adaptation_rate", self.adaptation_rate, "1/s^2")
        if self.adaptation_rate.ndim:
            count = self.regressor.parametrization().nominal.size
            checks.length("adaptation_rate", self.adaptation_rate, count, "parameters of the model")

    def init_law(self, y: Measurement, r: Target) -> Parameters:
        return self.regressor.parametrization().nominal

    def acceleration(self, state: Parameters, y: Measurement, tracking_error: TrackingError):
        structure, surface = self.regressor.parametrization(), self._surface(tracking_error)
        force, nominal = self._force(state, y, tracking_error), self._force(structure.nominal, y, tracking_error)
        # This is the whole acceleration; the path that all laws share compensates the modelled forces once more.
        demanded = self.regressor.accelerated_by(y, force + self.gain * structure.inertia * surface)
        signals = {
            "estimate": self.regressor.accelerated_by(y, nominal - force),
            "surface": surface,
            "parameter_change": (jnp.abs(state - structure.nominal) / structure.most).max(),
        }
        return demanded + self._compensated(y, tracking_error), signals

    def update(
        self, state: Parameters, y: Measurement, tracking_error: TrackingError, actuation: ActuationResult, dt
    ) -> Parameters:
        """Parameters one sampling time later.

        Euler's method adds T / 2 theta_dot^T (gamma Gamma)^-1 theta_dot to V_dot. Where that is more than half of what
        feedback takes away, adaptation is slowed down to it, so that V falls at any sampling time. Nothing is learnt
        from errors that no input moves.
        """
        structure, surface = self.regressor.parametrization(), self._surface(tracking_error)
        _, transposed = jax.vjp(lambda parameters: self._force(parameters, y, tracking_error), state)
        (slope,) = transposed(self._within_reach(y, surface))
        rate = self.adaptation_rate * structure.rates * slope
        added, dissipated = dt * (slope * rate).sum(), (self.gain * structure.inertia * surface**2).sum()
        share = jnp.where(added > dissipated, dissipated / jnp.where(added > dissipated, added, 1.0), 1.0)
        share = jnp.where(actuation.share < _WHOLE, 0.0, share)
        adapted = state + dt * share * rate
        return jnp.clip(adapted, structure.nominal - structure.most, structure.nominal + structure.most)

    def signals(self):
        surface = Signal(("axis",), "[axis]/s", "distance s from the surface")
        return ESTIMATE | {"surface": surface, "parameter_change": _CHANGE} | ATTAINED_SHARE

    def _surface(self, tracking_error: TrackingError) -> PerAxis:
        return tracking_error.rate + self.slope * jnp.clip(tracking_error.error, -self.reach, self.reach)

    def _force(self, parameters: Parameters, y: Measurement, tracking_error: TrackingError) -> PerAxis:
        velocity = self.model.coordinates.velocity(y) + self._surface(tracking_error)
        counting = jnp.where(jnp.abs(tracking_error.error) < self.reach, tracking_error.rate, 0.0)
        acceleration = tracking_error.acceleration + self.slope * counting
        return self.regressor.generalized_force(y, parameters, velocity, acceleration)


@flat_options("feedforward")
def slotine_li(
    model: Model,
    *,
    conditions: DesignConditions = DesignConditions(),
    slope=None,
    gain=None,
    adaptation_rate=None,
    reach=None,
    actuation: ActuationOptions = ActuationOptions(),
) -> SlotineLi:
    """Passivity-based adaptive control: Slotine and Li (1987; 1991, section 9.2). Body axes and quaternions.

    The regressor is that of the whole nominal model where the model has one: a vehicle (inertia, linear and quadratic
    drag, weight and its moments, constant loads: 28 parameters) and the two-link arm. Other plants have factors of
    inertia and drift and a load for each axis. Errors of rotating axes are treated as if the axes did not turn.

    Args:
        model: nominal model, from `plant.model()`.
        slope: l, rate of decay on the surface, 1/s; one number or one per axis. None: the one of least predicted cost
            that keeps the margins of `bandwidths.py` with the other defaults.
        gain: k, rate of decay of s, 1/s; one number or one per axis. None: the slope.
        adaptation_rate: gamma, 1/s^2; one number, or one per parameter. None: a tenth of the square of the smallest
            slope. 0 for none.
        reach: largest error that counts, m and rad. None: the one at which feedback asks for half of
            the authority of the actuators, and 1e6 where they have no limit.
        reference_frequency: that of the filter of reference jumps, rad/s; None: half of the slope, 2 at most; 0 for no
            filter.

    Raises:
        BadInput: a value is out of its range.
    """
    model = model.in_body_axes()
    axes = axes_of(model, conditions)
    if slope is None:
        slope = scalar_if_uniform([best_frequency(axis, _small_errors) for axis in axes])
    checks.per_axis("slope", slope, len(axes))
    checks.positive("slope", slope)
    gain = slope if gain is None else gain
    if reach is None:
        authorities = [axis.authority for axis in axes]
        stiffness = jnp.asarray(slope, dtype=float) * jnp.asarray(gain, dtype=float)
        reach = jnp.minimum(_HALF * jnp.asarray(authorities, dtype=float) / stiffness, _FAR)
    if adaptation_rate is None:
        adaptation_rate = _ADAPTATION * jnp.min(jnp.asarray(slope, dtype=float)) ** 2
    dynamics = model.dynamics
    regressor = dynamics if isinstance(dynamics, AbstractParametricDynamics) else DiagonalDynamics(dynamics, len(axes))
    return SlotineLi(
        model=model,
        actuation=actuation_for(conditions.sampling_time, slope, actuation),
        regressor=regressor,
        slope=slope,
        gain=gain,
        adaptation_rate=adaptation_rate,
        reach=reach,
    )


def _small_errors(slope, s) -> LoopTransfer:
    """The law with the default gains, and the load as only parameter."""
    adaptation = _ADAPTATION * slope**2
    return LoopTransfer(slope**2 + adaptation + adaptation * slope / s, 2 * slope + 0 * s)
