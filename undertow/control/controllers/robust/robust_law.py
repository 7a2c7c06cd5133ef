"""The robust law: Eqs. (18)-(44) modified for real vehicles. Sections 3.12, 6 and 7 of the theory."""

from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from undertow.control.controllers.bandwidths import largest_forces
from undertow.control.controllers.law_signals import ADAPTIVE_LAW, INERTIA, MEMORY, lyapunov_signals, weight_signals
from undertow.control.controllers.reference_filter import FilterState, ReferenceFilter, Room
from undertow.control.controllers.robust import evidence
from undertow.control.controllers.robust.estimator import Estimator, EstimatorState, UncertaintyEstimate
from undertow.control.controllers.robust.memory import Memory, MemoryState, TrainingSample
from undertow.control.controllers.thruster_allocation import allocate, attained
from undertow.control.controllers.tracking_error import Tracking, check_gains, tracking
from undertow.control.estimation.fuzzy_system import FuzzySystem
from undertow.core import checks
from undertow.core.contracts import AbstractController, Measurement, Model, Target, TrackingError
from undertow.core.numerics.linear_algebra import companion_lyapunov, matvec
from undertow.core.param import Param, param

PerAxis = Float[Array, " n"]

# An attained share below this means that limits bind; above it the difference from 1 is rounding.
_WHOLE = 0.999

# Times the authority of the actuators for an axis over its position gain: from up to 16 of these, full force in both
# directions does not overshoot. From further away the target is moved towards the vehicle.
_FAR = 4.0


class RobustState(NamedTuple):
    """State z of the law."""

    estimator: EstimatorState
    actuators: Any  # estimated state of the actuators
    filter: FilterState | None
    memory: MemoryState | None = None


class Recalled(NamedTuple):
    """What a memory gives at one instant."""

    phi: Float[Array, " k"]  # regressor
    correction: PerAxis  # desired acceleration besides that of the reference, less what the observer adds
    value: PerAxis  # what is known besides the observer, m/s^2, rad/s^2


class RobustDecisions(NamedTuple):
    """Decisions of one instant."""

    actuators: Any
    seen: UncertaintyEstimate
    tracking_error: Tracking  # error from the target, filtered if there is a filter
    robust: PerAxis  # u_r
    desired: PerAxis  # acceleration, m/s^2, rad/s^2
    forces: Float[Array, " m"]  # for the desired acceleration, without limits
    recalled: Recalled | None


class RobustRCAF(AbstractController):
    """The paper's structure in body axes, with the applied input in the estimator and actuator limits.

    Unlike in Eq. (23), the drift is compensated as it is at the velocity of the target; the estimator takes the one at
    the measured velocity.

    Gains are one number for all axes or one per axis. With `tracking_share` 0 the estimator is a pure observer: it
    depends on neither the controller nor its limits.

    Raises:
        BadInput: a gain of the wrong sign, feedback not Hurwitz or weight not positive definite.
    """

    model: Model
    estimator: Estimator
    filter: ReferenceFilter | None
    feedback: Float[Param, "*#n 2"] = param("1/s^2, 1/s", "state feedback", symbol="K")
    weight: Float[Param, "*#n 2 2"] = param("", "weight of Eq. (21)", symbol="Q", default=((10.0, 0.0), (0.0, 10.0)))
    tracking_share: Float[Param, "..."] = param(
        "", "share of the filtered tracking error in the adaptation, 1 / gamma_eps", symbol="mu", default=0.0
    )
    robust_gain: Float[Param, "..."] = param(
        "m/s^2, rad/s^2", "amplitude of the robust term", symbol="w_bar", default=0.0
    )
    layer: Float[Param, "..."] = param("unit of s", "boundary layer of the robust term", symbol="phi", default=0.5)
    actuator_rate: Float[Param, ""] = param("1/s", "bandwidth of the actuator loop", symbol="lambda", default=100.0)

    direction: Float[Param, ""] = param(
        "", "cost of a departure from the desired direction, where limits bind, relative to a loss of size", default=1.0
    )
    memory: Memory | None = None

    def __check_init__(self):
        for name in ("tracking_share", "robust_gain"):
            checks.not_negative(name, getattr(self, name))
        for name in ("layer", "actuator_rate", "direction"):
            checks.positive(name, getattr(self, name))
        gains = {name: getattr(self, name) for name in ("tracking_share", "robust_gain", "layer")}
        estimators = {name: getattr(self.estimator, name) for name in ("bandwidth", "damping", "bound", "leakage")}
        check_gains(self.feedback, self.weight, gains | estimators, len(self.model.coordinates.angles))
        if self.memory is not None:
            self.memory.check_fit(len(self.model.coordinates.angles), bool(self.model.coordinates.axes))

    @property
    def fuzzy(self) -> FuzzySystem:
        """Fuzzy system of the estimator."""
        return self.estimator.fuzzy

    @property
    def weights_bound(self) -> Float[Array, "..."]:
        """theta_max of the estimator, m/s^2 and rad/s^2."""
        return self.estimator.bound

    def init(self, y: Measurement, r: Target) -> RobustState:
        smoothing = None if self.filter is None else self.filter.init(y.position)
        _, coordinates, actuators = self.model
        velocity = coordinates.velocity(y)
        remembered = None if self.memory is None else self.memory.init(velocity.shape[0], bool(coordinates.axes))
        return RobustState(self.estimator.init(velocity), actuators.init(), smoothing, remembered)

    def command(self, z: RobustState, y: Measurement, r: Target):
        plan, actuators, effect = self._plan(z, y, r), self.model.actuators, self.model.dynamics.gain(y)
        forces = allocate(effect, plan.forces, *actuators.range(plan.actuators, self.actuator_rate), self.direction)
        u = actuators.command(plan.actuators, forces, self.actuator_rate)
        signals = {
            "estimate": plan.seen.uncertainty,
            "robust_term": plan.robust,
            "modelling_error": plan.seen.error,
            "attained_share": attained(effect, plan.forces, forces),
        }
        signals |= lyapunov_signals(plan.tracking_error, self.lyapunov(), self.weight)
        if self.memory is not None and z.memory is not None and plan.recalled is not None:
            signals |= {
                "memory": plan.recalled.value,
                "memory_weights": z.memory.weights,
                "memory_taken": z.memory.taken,
                "memory_trust": evidence.trust(z.memory.evidence),
                "memory_variance": jnp.diagonal(z.memory.covariance) / self.memory.learning_rate,
            }
            signals |= self.memory.inertia_signals(z.memory)
        return u, signals | weight_signals(z.estimator.weights, self.estimator.bound)

    def advance(self, z: RobustState, y: Measurement, r: Target, u_applied, dt) -> RobustState:
        plan, actuators, effect = self._plan(z, y, r), self.model.actuators, self.model.dynamics.gain(y)
        # While limits bind, the reference waits, and the tracking error is not caused by d.
        applied = actuators.target_of(plan.actuators, u_applied, self.actuator_rate)
        share = attained(effect, plan.forces, applied)
        tracking_term = jnp.where(share < _WHOLE, 0.0, self.tracking_share * plan.tracking_error.filtered)
        modelled = self._known(plan.actuators, y, u_applied)
        remembered, lost = None, None
        if self.memory is not None and z.memory is not None and plan.recalled is not None:
            tracking_error, correction = plan.tracking_error, plan.recalled.correction
            unexplained = plan.seen.uncertainty - plan.recalled.value
            nominal = modelled - tracking_error.acceleration
            sample = TrainingSample(
                unexplained, plan.seen.error, tracking_error.error, correction, -tracking_error.rate, nominal
            )
            gains = tuple(jnp.mean(gain) for gain in self.estimator.gains(dt))
            free = jnp.where(share < _WHOLE, 0.0, 1.0)
            remembered, lost = self.memory.advance(z.memory, plan.recalled.phi, sample, gains, free, dt)
            # What differs from the desired acceleration acts on the inertia that was learnt.
            expected = modelled + plan.seen.uncertainty
            modelled = modelled + (1 / self.memory.inertia_ratio(z.memory) - 1) * (expected - plan.desired)
        estimator = self.estimator.advance(z.estimator, plan.seen, modelled, tracking_term, dt)
        if lost is not None:
            estimator = self.estimator.lowered(estimator, lost)
        return RobustState(
            estimator=estimator,
            actuators=actuators.advance(plan.actuators, u_applied, dt),
            filter=self.filter
            and self.filter.advance(z.filter, r, self.model.coordinates, share, dt, self._room(y, plan.tracking_error)),  # pyright: ignore[reportArgumentType] - a law with a filter has its state
            memory=remembered,
        )

    def _room(self, y: Measurement, tracking_error: Tracking) -> Room:
        """Authority of the actuators for each output, and the part of the error that exceeds it."""
        dynamics, coordinates, actuators = self.model
        effect = dynamics.gain(y)
        force = largest_forces(actuators, effect.shape[1])
        reach = _FAR * matvec(jnp.abs(effect), force) / self.feedback[..., 0]
        away = jnp.abs(tracking_error.error) > reach
        outward = lambda motion: coordinates.output_velocity(y, motion)
        return Room(
            most=matvec(jnp.abs(jax.vmap(outward, 1, 1)(effect)), force),
            excess=outward(tracking_error.error - jnp.clip(tracking_error.error, -reach, reach)),
            pace=outward(jnp.where(away, tracking_error.rate, 0.0)),
        )

    def known_acceleration(self, z: RobustState, y: Measurement, u_applied) -> PerAxis:
        return self._known(self.model.actuators.update_from_report(z.actuators, y.actuator), y, u_applied)

    def signals(self):
        if self.memory is None:
            return ADAPTIVE_LAW
        return ADAPTIVE_LAW | MEMORY if self.memory.inertia is None else ADAPTIVE_LAW | MEMORY | INERTIA

    def lyapunov(self) -> Float[Array, "*#n 2 2"]:
        """P of Eq. (21)."""
        return companion_lyapunov(self.feedback, self.weight)

    def _known(self, actuators: Any, y: Measurement, u_applied) -> PerAxis:
        dynamics, forces = self.model.dynamics, self.model.actuators.force(actuators, u_applied)
        return dynamics.drift(y) + matvec(dynamics.gain(y), forces)

    def _plan(self, z: RobustState, y: Measurement, r: Target) -> RobustDecisions:
        dynamics, coordinates, actuators = self.model
        reported = actuators.update_from_report(z.actuators, y.actuator)
        target = r if self.filter is None else self.filter.smoothed(z.filter, r, coordinates)  # pyright: ignore[reportArgumentType] - a law with a filter has its state
        tracking_error = tracking(coordinates, self.lyapunov(), y, target)
        recalled = None
        u_r = self.robust_gain * jnp.tanh(tracking_error.filtered / self.layer)
        velocity = coordinates.velocity(y)
        estimate = self.estimator.estimate(z.estimator, velocity)
        desired = tracking_error.acceleration + tracking_error.feedback(self.feedback) + u_r
        if self.memory is not None and z.memory is not None:
            at = TrackingError(tracking_error.error, tracking_error.rate, tracking_error.acceleration)
            phi = self.memory.regressors(y, velocity, at, bool(coordinates.axes))
            desired = desired + self.memory.probing(z.memory, self.feedback)
            correction = desired - tracking_error.acceleration - estimate.uncertainty
            recalled = Recalled(phi, correction, self.memory.value(z.memory, phi, correction))
            estimate = estimate._replace(uncertainty=estimate.uncertainty + recalled.value)
        compensated = estimate.uncertainty + self.model.drift_at_target_velocity(y, tracking_error.rate)
        forces = dynamics.invert(y, desired - compensated)
        return RobustDecisions(reported, estimate, tracking_error, u_r, desired, forces, recalled)
