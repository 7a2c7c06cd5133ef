"""Gate for measurements: readings that cannot be true are replaced by the prediction of the nominal model.

Those are readings that are not finite, implausibly large, too far from the prediction, or stuck. The prediction holds
the applied input and the law's estimate of the uncertainty, so that the law does not adapt to it.
"""

from typing import Any, NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Bool, Float

from undertow.control.supervision.innovations import InnovationMonitor, InnovationState, JumpLimits
from undertow.control.supervision.motion import MonitoredMotion, length, motion_of, predicted, split, with_motion
from undertow.control.supervision.stuck_readings import StuckReadings, StuckState
from undertow.core import checks
from undertow.core.contracts import Measurement
from undertow.core.numerics.rotations import attitude_error
from undertow.core.param import Param, param

Scalar = Float[Array, ""]

# Larger reports of the actuators are none of a propeller, rad/s and rad/s^2.
_FASTEST = 1e5
_LARGEST = 1e12  # of any reading, in any unit


class GateState(NamedTuple):
    """State of the gate."""

    expected: MonitoredMotion  # at this instant
    rates: Array  # believed rates of the outputs, m/s and rad/s
    stuck: StuckState
    innovations: InnovationState
    since: Scalar  # time since the last step, s
    actuator: Any  # last finite report of the actuators


class Passed(NamedTuple):
    """What the gate lets through, and what it found."""

    measurement: Measurement
    stuck: StuckState
    innovations: InnovationState
    not_finite: Scalar  # entries
    implausible: Scalar  # largest size relative to its limit
    jump: Scalar  # largest difference from the prediction relative to its limit
    contradiction: Scalar  # between position and velocity, relative to the limit of a jump
    noise: Scalar  # mean size of the differences relative to the largest one
    missing: Scalar  # motion missing from stuck readings relative to its limit
    unreported: Scalar  # entries of the report of the actuators that are not finite, or no speed of a propeller


def conceivable(y: Measurement) -> Measurement:
    """The measurement with NaN for numbers that are no motion in any unit: their squares might be infinite."""
    read = lambda array: jnp.where(jnp.abs(array) <= _LARGEST, array, jnp.nan)
    body = y.body and y.body._replace(nu=read(y.body.nu))
    return y._replace(position=read(y.position), velocity=read(y.velocity), body=body)


class MeasurementGate(eqx.Module):
    """Limits of plausible readings.

    Raises:
        BadInput: a limit is not positive.
    """

    stuck: StuckReadings
    innovations: InnovationMonitor
    max_distance: Float[Param, ""] = param("m", "largest plausible coordinate")
    max_speed: Float[Param, ""] = param("m/s", "largest plausible velocity")
    max_rate: Float[Param, ""] = param("rad/s", "largest plausible angular velocity")
    jump_position: Float[Param, ""] = param("m", "largest plausible difference of a position from its prediction")
    jump_angle: Float[Param, ""] = param("rad", "the same of the attitude, as a rotation")
    jump_velocity: Float[Param, ""] = param("m/s", "the same of velocity")
    jump_rate: Float[Param, ""] = param("rad/s", "the same of angular velocity")

    def __check_init__(self):
        for name in ("max_distance", "max_speed", "max_rate", *(n for n in vars(self) if n.startswith("jump"))):
            checks.positive(name, getattr(self, name), finite=False)

    def init(self, y: Measurement) -> GateState:
        """State before the first measurement; what is not finite in it is expected to be zero, the attitude level."""
        read = motion_of(y)
        zero = lambda array: jnp.where(jnp.isfinite(array), array, 0.0)
        level = jnp.eye(4)[0] if read.attitude.shape[0] else read.attitude
        attitude = jnp.where(jnp.isfinite(read.attitude).all(), read.attitude, level)
        expected = MonitoredMotion(zero(read.position), attitude, zero(read.velocity))
        believed, actuator = with_motion(y, expected), jax.tree.map(zero, y.actuator)
        stuck, innovations = self.stuck.init(y), self.innovations.init(expected)
        return GateState(expected, believed.velocity, stuck, innovations, jnp.zeros(()), actuator)

    def pass_through(self, state: GateState, y: Measurement, believe: Bool[Array, ""]) -> Passed:
        """The measurement, with predictions in place of readings that cannot be true.

        Args:
            state: after the last step.
            y: measurement.
            believe: whether a jump is taken as the truth, since the prediction is not.
        """
        read, expected = motion_of(y), state.expected
        finite = MonitoredMotion(*map(jnp.isfinite, read))
        of_size, of_jump = self._sizes(read), self._jumps(read, expected)
        stuck_state = self.stuck.after(state.stuck, y, state.rates, state.since)
        stuck = self.stuck.found(stuck_state)
        held = MonitoredMotion(*(part > 0 for part in _of_motion(read, stuck.position, stuck.velocity)))
        where_valid = lambda ratios, valid: MonitoredMotion(
            *(jnp.where(w, r, 0.0) for w, r in zip(valid, ratios, strict=True))
        )
        sizes = where_valid(of_size, finite)
        # What is stuck departs from its prediction, of course.
        jumps = where_valid(of_jump, MonitoredMotion(*(f & ~h for f, h in zip(finite, held, strict=True))))
        good = MonitoredMotion(
            *(
                is_finite & (size <= 1) & ((jump <= 1) | believe) & ~is_held
                for is_finite, size, jump, is_held in zip(finite, sizes, jumps, held, strict=True)
            )
        )
        # A quaternion is good as a whole, or not at all.
        good = good._replace(attitude=jnp.broadcast_to(good.attitude.all(), good.attitude.shape))
        usable = jax.tree.map(lambda now: jnp.abs(now) <= _FASTEST, y.actuator)  # false for NaN
        reported = jax.tree.map(lambda good, now, last: jnp.where(good, now, last), usable, y.actuator, state.actuator)
        unreported = sum((~good).sum(dtype=float) for good in jax.tree.leaves(usable))
        y = y._replace(actuator=reported)

        motion = MonitoredMotion(*(jnp.where(g, r, e) for g, r, e in zip(good, read, expected, strict=True)))

        all_good = jnp.stack([entries.all() for entries in good]).all()
        missing = jnp.stack([(~entries).sum(dtype=float) for entries in finite]).sum()
        largest = lambda ratios: jnp.stack([entries.max(initial=0.0) for entries in ratios]).max()
        measurement = jax.lax.cond(all_good, lambda: y, lambda: with_motion(y, motion))
        jump_limits = JumpLimits(self.jump_position, self.jump_angle, self.jump_velocity, self.jump_rate)
        innovations = self.innovations.after(state.innovations, motion, expected, jump_limits, believe, state.since)
        # Actuators of which nobody has ever reported anything but rest are not lost.
        reports = jax.tree.leaves(state.actuator)
        largest_report = jnp.stack([jnp.zeros(()), *(jnp.abs(report).max() for report in reports)]).max()
        lost_reports = jnp.where(largest_report > 0, jnp.asarray(unreported, dtype=float), 0.0)
        return Passed(
            measurement=measurement,
            stuck=stuck_state,
            innovations=innovations,
            not_finite=missing,
            implausible=largest(sizes),
            jump=largest(jumps),
            contradiction=self.innovations.contradiction(innovations),
            noise=self.innovations.noise_ratio(innovations),
            missing=stuck.missing,
            unreported=lost_reports,
        )

    def after(self, passed: Passed, rate: Array, dt: Scalar) -> GateState:
        """State one step later, for a rate of the velocity (m/s^2, rad/s^2) by the model, and the time passed (s).

        A prediction stays within what is plausible: one that is made from predictions again and again, by steps that
        are too long for the drag of a fast vehicle, would grow until it is no number.
        """
        y = passed.measurement
        motion, expected = motion_of(y), predicted(y, rate, dt)
        speed = _each(expected.velocity, self.max_speed, self.max_rate)
        expected = expected._replace(
            position=jnp.clip(expected.position, -self.max_distance, self.max_distance),
            velocity=jnp.clip(expected.velocity, -speed, speed),
        )
        expected = MonitoredMotion(*(jnp.where(jnp.isfinite(e), e, n) for e, n in zip(expected, motion, strict=True)))
        return GateState(expected, y.velocity, passed.stuck, passed.innovations, jnp.asarray(dt), y.actuator)

    def _sizes(self, read: MonitoredMotion) -> MonitoredMotion:
        """Sizes of readings relative to their limits."""
        velocity = _each(read.velocity, self.max_speed, self.max_rate)
        return MonitoredMotion(
            jnp.abs(read.position) / self.max_distance, jnp.zeros_like(read.attitude), jnp.abs(read.velocity) / velocity
        )

    def _jumps(self, read: MonitoredMotion, expected: MonitoredMotion) -> MonitoredMotion:
        """Differences between readings and predictions relative to their limits."""
        turn = jnp.zeros(0)
        if read.attitude.shape[0]:
            attitude_difference = attitude_error(read.attitude, expected.attitude)
            turn = jnp.broadcast_to(length(attitude_difference) / self.jump_angle, (4,))
        return MonitoredMotion(
            jnp.abs(read.position - expected.position) / self.jump_position,
            turn,
            jnp.abs(read.velocity - expected.velocity) / _each(read.velocity, self.jump_velocity, self.jump_rate),
        )


def _of_motion(read: MonitoredMotion, outputs: Array, velocity: Array) -> MonitoredMotion:
    """Flags of outputs and velocities, as those of a motion: an attitude as a whole."""
    if not read.attitude.shape[0]:
        return MonitoredMotion(outputs, read.attitude, velocity)
    return MonitoredMotion(outputs[:3], jnp.broadcast_to(outputs[3:].max(), (4,)), velocity)


def _each(velocity: Array, linear: Any, angular: Any) -> Array:
    """A value for the linear and one for the angular entries of a velocity."""
    parts = split(velocity)
    return jnp.concatenate(
        [jnp.broadcast_to(value, part.shape) for value, part in zip((linear, angular), parts, strict=True)]
    )
