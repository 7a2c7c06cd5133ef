"""Nonlinear model predictive control: forces over the next second, a few optimisation steps per sampling time."""

from typing import Any, NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from undertow.control.controllers.actuation import AbstractAccelerationLaw, Actuation, ActuationResult
from undertow.control.controllers.law_signals import ATTAINED_SHARE, ESTIMATE
from undertow.control.controllers.observer_gains import gains_and_path
from undertow.control.controllers.options import ActuationOptions, DesignConditions
from undertow.control.controllers.receding_horizon import Horizon, Improved, improved, regulator
from undertow.control.estimation.sampled_observer import corrected_disturbance
from undertow.core import checks
from undertow.core.contracts import Measurement, Model, Target, TrackingError
from undertow.core.errors import BadInput
from undertow.core.numerics.linear_algebra import matvec
from undertow.core.option_groups import flat_options
from undertow.core.param import Param, param

PerAxis = Float[Array, " n"]

_TIMES, _LONGEST = 4.0, 1.0  # length of the horizon: times 1 / w; s
_LIMITLESS = 1e6  # N, or the unit of the force: infinity has no gradient


class PlannedState(NamedTuple):
    """State of the law."""

    plan: Improved
    acceleration: PerAxis  # of the target and for the plan, m/s^2, rad/s^2
    predicted: PerAxis  # velocity that the next one corrects, m/s, rad/s
    estimate: PerAxis  # d_hat of the plan, m/s^2, rad/s^2
    elapsed: Float[Array, ""]  # s, since the plan


class NMPC(AbstractAccelerationLaw):
    """Minimum of the integral of w^4 e^2 + 2 w^2 e_dot^2 + e_ddot^2 over the horizon, with forces within their limits.

    e_ddot = a_d - F(x) - G(x) f - d_hat along the predicted motion; a_d and d_hat are held over the horizon. Where no
    limit binds this is the law a = a_d + w^2 e + 2 w e_dot - d_hat, up to the step of the horizon. Real-time iteration
    (Diehl, Bock and Schloeder 2005): after each measurement a few Gauss-Newton steps from the plan of before; the next
    measurement enters by the feedback gain of the last one. d_hat is that of `disturbance_observer`.

    Raises:
        BadInput: a value is not positive.
    """

    model: Model
    actuation: Actuation
    bandwidth: Float[Param, "..."] = param("rad/s", "bandwidth of the observer", symbol="l", range=(0.3, 30.0))
    tracking: Float[Param, "..."] = param(
        "rad/s", "natural frequency of the tracking error", symbol="w", range=(0.2, 15.0)
    )
    horizon: Float[Param, ""] = param("s", "length of the horizon")
    steps: int = eqx.field(static=True, default=10)
    iterations: int = eqx.field(static=True, default=2)

    def __check_init__(self):
        for name in ("bandwidth", "tracking", "horizon"):
            checks.positive(name, getattr(self, name))
        for name in ("bandwidth", "tracking"):
            checks.per_axis(name, getattr(self, name), len(self.model.coordinates.angles))

    def init_law(self, y: Measurement, r: Target) -> PlannedState:
        velocity = self.model.coordinates.velocity(y)
        still, inputs = jnp.zeros_like(velocity), self.model.dynamics.gain(y).shape[1]
        start = jnp.concatenate([still, still])
        plan = Improved(jnp.zeros((self.steps, inputs)), start, jnp.zeros((inputs, start.shape[0])))
        return PlannedState(plan, still, velocity, still, jnp.zeros(()))

    def acceleration(self, state: PlannedState, y: Measurement, tracking_error: TrackingError):
        dynamics, estimate, horizon = self.model.dynamics, self._estimate(state, y), self._horizon(y)
        error_state = jnp.concatenate([tracking_error.error, tracking_error.rate])
        force = state.plan.forces[0] + matvec(state.plan.gain, error_state - state.plan.start)
        compensated, effect = self._compensated(y, tracking_error), dynamics.gain(y)
        planned = compensated + matvec(effect, jnp.clip(force, horizon.low, horizon.high))
        # What has become known since the plan enters at once.
        planned = planned + (tracking_error.acceleration - state.acceleration) - (estimate - state.estimate)
        gains = regulator(horizon)[1]
        error, rate, acceleration = tracking_error
        fallback = acceleration + gains[:, 0] * error + gains[:, 1] * rate - estimate
        usable = (state.elapsed > 0) & jnp.isfinite(planned).all()
        return jnp.where(usable, planned, fallback), {"estimate": estimate}

    def update(
        self, state: PlannedState, y: Measurement, tracking_error: TrackingError, actuation: ActuationResult, dt
    ) -> PlannedState:
        """The plan, moved on by dt and improved from the measured state; made anew where it was not finite."""
        estimate, horizon = self._estimate(state, y), self._horizon(y)
        forces = state.plan.forces
        share = jnp.minimum(state.elapsed / horizon.step, 1.0)
        warm_start = forces + share * (jnp.concatenate([forces[1:], forces[-1:]]) - forces)
        usable = jnp.isfinite(warm_start).all()
        warm_start = jnp.where(usable, jnp.clip(warm_start, horizon.low[None, :], horizon.high[None, :]), 0.0)
        start = jnp.concatenate([tracking_error.error, tracking_error.rate])
        motion = self._motion(y, tracking_error, estimate)
        iterate = lambda plan, _: (improved(motion, horizon, start, plan.forces), None)
        plan, _ = jax.lax.scan(iterate, state.plan._replace(forces=warm_start, start=start), None, self.iterations)
        predicted = self.model.coordinates.velocity(y) + dt * (actuation.modelled + estimate)
        return PlannedState(plan, tracking_error.acceleration, predicted, estimate, dt)

    def signals(self):
        return ESTIMATE | ATTAINED_SHARE

    def _estimate(self, state: PlannedState, y: Measurement) -> PerAxis:
        velocity = self.model.coordinates.velocity(y)
        return corrected_disturbance(state.estimate, state.predicted, velocity, self.bandwidth, state.elapsed)

    def _horizon(self, y: Measurement) -> Horizon:
        inputs, axes = self.model.dynamics.gain(y).shape[1], y.position.shape[0]
        held = self.model.actuators.quasi_static()
        low, high = (jnp.broadcast_to(bound, (inputs,)) for bound in held.range(held.init(), jnp.ones(())))
        w = jnp.broadcast_to(self.tracking, (axes,))
        return Horizon(
            self.horizon / self.steps, w**4, 2 * w**2, jnp.maximum(low, -_LIMITLESS), jnp.minimum(high, _LIMITLESS)
        )

    def _motion(self, y: Measurement, tracking_error: TrackingError, estimate: PerAxis) -> Any:
        """Bending of the error along the predicted motion, for `receding_horizon`."""
        dynamics, coordinates, _ = self.model
        velocity = coordinates.velocity(y)

        def motion(t, state):
            error, rate = jnp.split(state, 2)
            desired = velocity + tracking_error.rate  # of the target, now
            displacement = t * desired + t**2 / 2 * tracking_error.acceleration - (error - tracking_error.error)
            position = y.position + coordinates.output_velocity(y, displacement)
            predicted = coordinates.measurement(position, jnp.zeros_like(position), y.actuator)
            speed = coordinates.output_velocity(predicted, desired + t * tracking_error.acceleration - rate)
            predicted = coordinates.measurement(position, speed, y.actuator)
            return tracking_error.acceleration - dynamics.drift(predicted) - estimate, -dynamics.gain(predicted)

        return motion


@flat_options("feedforward")
def nmpc(
    model: Model,
    *,
    conditions: DesignConditions = DesignConditions(),
    bandwidth=None,
    tracking=None,
    horizon=None,
    steps: int = 10,
    iterations: int = 2,
    actuation: ActuationOptions = ActuationOptions(motor="computed"),
) -> NMPC:
    """Nonlinear model predictive control with a fixed number of operations per step: Diehl et al. (2005). Body axes.

    Near pitch 90 degrees the prediction, which is in Euler angles, does not exist; the law then uses the gains of its
    end, those of a regulator.

    Args:
        model: nominal model, from `plant.model()`.
        bandwidth: l, pole of the disturbance observer, rad/s; one number or one per axis. None: as of
            `disturbance_observer`.
        tracking: w, natural frequency of the tracking error where no limit binds, rad/s; None: as of
            `disturbance_observer`.
        horizon: its length, s; None: 4 / w of the slowest axis, 1 s at most.
        steps: its number of steps.
        iterations: Gauss-Newton steps per sampling time. With one, a plan for which limits begin to bind or cease to
            bind is used before it has converged.
        actuator_rate: with motor = computed, bandwidth of the motor loop, 1/s; None: chosen with the bandwidth.

    Raises:
        BadInput: a value is out of its range.
    """
    if steps < 2:
        raise BadInput("steps", "be at least 2", steps)
    if iterations < 1:
        raise BadInput("iterations", "be at least 1", iterations)
    if horizon is not None:
        checks.positive("horizon", horizon, "s")
    model = model.in_body_axes()
    bandwidth, tracking, path = gains_and_path(model, conditions, actuation, (bandwidth, tracking), order=1)
    if horizon is None:
        horizon = jnp.minimum(_TIMES / jnp.min(jnp.asarray(tracking, dtype=float)), _LONGEST)
    return NMPC(
        model=model,
        actuation=path,
        bandwidth=bandwidth,
        tracking=tracking,
        horizon=horizon,
        steps=steps,
        iterations=iterations,
    )
