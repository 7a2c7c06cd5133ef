"""Error-state Kalman filter, which estimates the motion of a vehicle and the biases of its IMU from all its sensors.

J. Sola, Quaternion kinematics for the error-state Kalman filter, arXiv 1711.02508 (2017), with attitude errors in world
axes; Y. Bar-Shalom, Update with out-of-sequence measurements, IEEE Trans. Aerosp. Electron. Syst. 38 (2002), for late
readings (its algorithm without process noise over the delay).
"""

from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from undertow.control.navigation.consistency import innovation_monitor
from undertow.control.navigation.disagreement import distrusted, no_disagreement
from undertow.control.navigation.from_sensors import AbstractCovarianceFilter, SensorNavigation, check_sensors
from undertow.control.navigation.inertial_covariance import (
    ATTITUDE,
    FORCE_BIAS,
    GYRO_BIAS,
    MOTION_STATES,
    POSITION,
    VELOCITY,
    product,
    spread,
)
from undertow.control.navigation.inertial_gate import InertialGate, gate_for, inertial_deviation
from undertow.control.navigation.kalman_state import KalmanState, expected_reading
from undertow.control.navigation.motion_history import resting, spacing_for
from undertow.control.navigation.observability import Sensed, drift_sentences
from undertow.control.navigation.sensor_errors import Covariance, all_errors, error_states, faded, packing
from undertow.core import checks
from undertow.core.contracts import Measurement
from undertow.core.measurement import body_of, measurement_of_outputs, measurement_of_pose
from undertow.core.numerics.linear_algebra import matvec
from undertow.core.numerics.number import Number
from undertow.core.numerics.rotations import (
    Kinematics,
    Quaternion,
    Vector3,
    conjugate,
    quaternion_of_turn,
    quaternion_product,
    rotation_from_quaternion,
)
from undertow.core.param import Param, param
from undertow.core.signals import Signal
from undertow.physics.sensors.gauss_markov import CorrelatedErrors
from undertow.physics.sensors.imu import IMU
from undertow.physics.sensors.motion import gravity, motion_of
from undertow.physics.sensors.propeller_speed import PropellerSpeed
from undertow.physics.sensors.received import Received
from undertow.physics.sensors.sensor import AbstractSensor

_USUAL_DELAY = 0.5  # s
_LEAST_VARIANCE = 1e-12  # of a reading; one without noise would leave a covariance that is singular
# In SI units; ten times the circumference of the earth in metres. A larger number is no reading: variances that grow
# until it fits would drown the others in rounding errors.
_LARGEST_READING = 4e8


class Kalman(AbstractCovarianceFilter):
    """Strapdown inertial navigation whose errors are estimated by an extended Kalman filter.

    It takes every sensor that an undertow scenario can have, those of a user too: what a sensor would read at the
    estimate is its own `reading`, which is differentiated. Its variances are those of the sensors, times a scale.

    A late reading is compared with the estimate of its time. A reading whose errors exceed `gate` standard deviations
    is rejected; rejections in a row double the square that is tolerated, at most every 0.1 s and up to a thousand times
    the gate. A reading that is tolerated raises the variance of what it measures, so that the next one is taken. Where
    most sensors are rejected, it is the filter that errs: all its variances grow until they are taken. Gyroscopes and
    accelerometers pass a gate of their own, `InertialGate`. Entries that are not finite, or beyond any reading, are
    left out.

    Raises:
        BadInput: no IMU, or a deviation that is not positive.
    """

    sensors: tuple[AbstractSensor, ...]
    inertial: InertialGate
    position_deviation: Float[Param, ""] = param("m", "initial standard deviation of the position")
    velocity_deviation: Float[Param, ""] = param("m/s", "initial standard deviation of the velocity")
    tilt_deviation: Float[Param, ""] = param("rad", "initial standard deviation of roll and pitch")
    heading_deviation: Float[Param, ""] = param("rad", "initial standard deviation of the heading")
    gyro_bias_deviation: Float[Param, ""] = param("rad/s", "initial standard deviation of the biases of the gyroscopes")
    force_bias_deviation: Float[Param, ""] = param(
        "m/s^2", "initial standard deviation of the biases of the accelerometers"
    )
    gyro_drift: Float[Param, ""] = param("rad/s/s^0.5", "random walk of the biases of the gyroscopes")
    force_drift: Float[Param, ""] = param("m/s^2/s^0.5", "random walk of the biases of the accelerometers")
    gate: Float[Param, ""] = param("", "standard deviations beyond which a reading is rejected")
    noise_scale: Float[Param, ""] = param("", "assumed over stated standard deviations of the sensors")
    longest_delay: Float[Param, ""] = param("s", "of readings; older ones are taken to be of that age")
    sensor_error_states: bool = eqx.field(static=True, default=True)  # for the correlated errors of the sensors

    def __check_init__(self):
        check_sensors(self.sensors)
        for name in _DEVIATIONS:
            checks.positive(name, getattr(self, name))
        for name in ("gyro_drift", "force_drift", "longest_delay"):
            checks.not_negative(name, getattr(self, name))

    def start(self, y: Measurement) -> KalmanState:
        body, still = body_of(y), jnp.zeros(3)
        reports = any(isinstance(sensor, PropellerSpeed) for sensor in self.sensors)
        errors = self._sensor_errors()
        return KalmanState(
            y.position[:3],
            body.attitude,
            y.velocity[:3],
            still,
            still,
            self._initial_covariance()[packing(self._size()).upper],
            self.inertial.start(jnp.concatenate([body.nu[3:], matvec(body.rotation.T, -gravity())])),
            y.actuator if reports else None,
            resting(body.attitude),
            no_disagreement(len(self.sensors)),
            jnp.zeros((), dtype=int),
            innovation_monitor([self._compared(sensor, y) for sensor in self.sensors]),
            None if errors is None else jnp.zeros(len(errors.deviation)),
        )

    def update(self, state: KalmanState, elapsed: Number, received: tuple[Received, ...]) -> KalmanState:
        deliveries = tuple(zip(self.sensors, received, strict=True))
        imu, inertial = next((sensor, delivery) for sensor, delivery in deliveries if isinstance(sensor, IMU))
        deviation = inertial_deviation(imu, self.noise_scale)
        memory = self.inertial.received(state.inertial, elapsed, inertial.reading[2:], inertial.fresh, deviation)
        covariance = self.covariance(state)
        turning = (memory.values[:3] + state.rates) / 2 - state.gyro_bias
        half = rotation_from_quaternion(_turned(state.attitude, elapsed / 2 * turning))
        acceleration = matvec(half, memory.values[3:] - state.force_bias) + gravity()
        history = state.history.after(
            elapsed, acceleration, _turned(state.history.attitude, elapsed * turning), spacing_for(self.longest_delay)
        )
        state = state._replace(
            position=state.position + elapsed * (state.velocity + elapsed / 2 * acceleration),
            velocity=state.velocity + elapsed * acceleration,
            attitude=_turned(state.attitude, elapsed * turning),
            inertial=memory,
            history=history,
            disagreement=state.disagreement.later(elapsed),
        )
        of_rates, of_force = self.inertial_noise(imu)
        odd = self.inertial.uncertainty(memory)
        of_inertial, of_biases = (of_rates + odd[:3], of_force + odd[3:]), (self.gyro_drift**2, self.force_drift**2)
        covariance = spread(covariance, elapsed, half, state.velocity, of_inertial, of_biases)
        errors = self._sensor_errors()
        if errors is not None and state.sensor_errors is not None:
            covariance = faded(covariance, errors, elapsed)
            state = state._replace(sensor_errors=errors.kept(elapsed) * state.sensor_errors)
        opened = jnp.zeros(len(covariance))
        for i, (sensor, delivery) in enumerate(deliveries):
            if isinstance(sensor, PropellerSpeed):
                state = state._replace(actuator=_propellers(state.actuator, sensor, delivery))
            else:
                state, covariance, distrust = self._corrected(state, covariance, i, delivery)
                opened = opened + distrust
        # What is tolerated after many rejections opens the gate for the next reading.
        covariance = covariance + jnp.where(np.eye(len(covariance), dtype=bool), opened[:, None], 0.0)
        disagreement, covariance = state.disagreement.reopening(self._periods(), covariance, self.initial_deviations())
        return state._replace(disagreement=disagreement, covariance=covariance[packing(len(covariance)).upper])

    def measurement(self, state: KalmanState) -> Measurement:
        rotation = rotation_from_quaternion(state.attitude)
        nu = jnp.concatenate([matvec(rotation.T, state.velocity), state.rates - state.gyro_bias])
        return measurement_of_pose(state.position, state.attitude, nu, state.actuator)

    def covariance(self, state: KalmanState) -> Covariance:
        """Covariance of the errors of attitude (rad, world axes), gyro bias, velocity (world), force bias, position.

        Behind them are the correlated errors of the sensors.
        """
        return state.covariance[packing(self._size()).where]

    def errors(self, state: KalmanState, truth: Measurement):
        """Errors of attitude (rad, world axes), velocity (m/s, in the axes of the estimate), position (m)."""
        body = body_of(truth)
        turn = quaternion_product(body.attitude, conjugate(state.attitude))
        turn = jnp.where(turn[0] < 0, -turn, turn)
        turned_back = matvec(rotation_from_quaternion(turn).T, truth.velocity[:3])
        return jnp.concatenate([2 * turn[1:], turned_back - state.velocity, truth.position[:3] - state.position])

    def error_covariance(self, state: KalmanState):
        covariance = self.covariance(state)
        rows = jnp.concatenate([covariance[ATTITUDE], covariance[VELOCITY], covariance[POSITION]])
        return jnp.concatenate([rows[:, ATTITUDE], rows[:, VELOCITY], rows[:, POSITION]], axis=1)

    def signals(self):
        return {
            "navigation_deviation": Signal(("axis",), "[axis]", "standard deviation of the estimate by the filter"),
            "rejected_readings": Signal((), "1", "readings so far that were too far from the estimate"),
            "innovation_rms": Signal(("sensor",), "1", "rms of the normalised innovations over 30 s; 1 as assumed"),
            "innovation_correlation": Signal(("sensor",), "1", "correlation of successive innovations; 0 as assumed"),
            "inconsistent_sensors": Signal(("sensor",), "1", "1 where innovations contradict what the filter assumes"),
            "rejected_inertial": Signal((), "1", "samples of the IMU so far that no motion of the vehicle explains"),
            "reopened_gates": Signal((), "1", "times so far that most sensors were believed against the filter"),
        }

    def diagnostics(self, state: KalmanState):
        covariance = self.covariance(state)
        turn = Kinematics(rotation_from_quaternion(state.attitude))
        # Errors of Euler angles from one of the attitude, which is in world axes.
        angles = jax.vmap(lambda e: turn.to_world(jnp.concatenate([jnp.zeros(3), matvec(turn.rotation.T, e)]))[3:])
        slopes = angles(jnp.eye(3)).T
        of_angles = (slopes[:, :, None] * slopes[:, None, :] * covariance[ATTITUDE, ATTITUDE][None]).sum((1, 2))
        variances = jnp.concatenate([jnp.diag(covariance)[POSITION], of_angles])
        return {
            "navigation_deviation": jnp.sqrt(variances),
            "rejected_readings": state.rejected,
            "innovation_rms": state.monitor.rms(),
            "innovation_correlation": state.monitor.correlation(),
            "inconsistent_sensors": state.monitor.inconsistent(self._periods()),
            "rejected_inertial": state.inertial.rejected,
            "reopened_gates": state.disagreement.reopened,
        }

    def _periods(self) -> Float[Array, " sensors"]:
        """Time between readings of each sensor, s."""
        return jnp.stack([jnp.asarray(sensor.sampling.period, dtype=float) for sensor in self.sensors])

    def _compared(self, sensor: AbstractSensor, y: Measurement) -> int:
        """Entries of a reading of a sensor that the filter compares with the estimate."""
        if isinstance(sensor, PropellerSpeed):
            return 0
        return 2 if isinstance(sensor, IMU) else sensor.reading(motion_of(y, y.velocity[:3], jnp.zeros(()))).size

    def advice(self, duration):
        # One program: by itself each of its hundred operations would be compiled.
        sensed, initial, noise = jax.tree.map(np.asarray, eqx.filter_jit(Kalman._at_rest)(self))
        return drift_sentences([Sensed(*entry) for entry in sensed], initial, noise, duration)

    def _at_rest(self) -> tuple[list[tuple[Array, Array, Array]], Array, Array]:
        """Of a vehicle at rest and level: slopes, variance and period of each sensor, deviations at first, noise."""
        level = self.start(measurement_of_outputs(jnp.zeros(6), jnp.zeros(6)))
        sensed = []
        for sensor in self.sensors:
            if not isinstance(sensor, PropellerSpeed):
                slopes = expected_reading(level, sensor, 0.0, None)[1]
                sensed.append((slopes, self.variance(sensor, len(slopes)), jnp.asarray(sensor.sampling.period)))
        of_rates, of_force = self.inertial_noise(next(sensor for sensor in self.sensors if isinstance(sensor, IMU)))
        ones = jnp.ones(3)
        drifts = [of_rates, self.gyro_drift**2 * ones, of_force, self.force_drift**2 * ones, 0 * ones]
        return sensed, self.initial_deviations(), jnp.concatenate(drifts)

    def initial_deviations(self) -> Float[Array, "15"]:
        """Standard deviations of the errors at the start."""
        tilt, heading, biased = self.tilt_deviation, self.heading_deviation, self.gyro_bias_deviation
        deviations = [tilt, tilt, heading, *[biased] * 3, *[self.velocity_deviation] * 3]
        deviations += [*[self.force_bias_deviation] * 3, *[self.position_deviation] * 3]
        return jnp.stack([jnp.asarray(deviation, dtype=float) for deviation in deviations])

    def _sensor_errors(self) -> CorrelatedErrors | None:
        """Correlated errors of the sensors that are states of this filter."""
        return all_errors(self.sensors, self.noise_scale) if self.sensor_error_states else None

    def _size(self) -> int:
        """Number of states."""
        errors = self._sensor_errors()
        return MOTION_STATES if errors is None else MOTION_STATES + len(errors.deviation)

    def _initial_covariance(self) -> Covariance:
        errors = self._sensor_errors()
        deviations = self.initial_deviations()
        if errors is not None:
            deviations = jnp.concatenate([deviations, errors.deviation])
        return jnp.diag(deviations**2)

    def inertial_noise(self, imu: IMU) -> tuple[Vector3, Vector3]:
        """Densities of the noise of gyroscopes, (rad/s)^2 s, and accelerometers, (m/s^2)^2 s."""
        density = inertial_deviation(imu, self.noise_scale) ** 2 * imu.sampling.period
        return density[:3], density[3:]

    def variance(self, sensor: AbstractSensor, width: int) -> Float[Array, " width"]:
        """Variance of each entry of a reading: of noise, resolution and offset."""
        sampling = sensor.sampling
        square = jnp.asarray(sampling.noise) ** 2 + jnp.asarray(sampling.resolution) ** 2 / 12
        variance = (square + jnp.asarray(sampling.bias) ** 2) * self.noise_scale**2
        if isinstance(sensor, IMU):
            variance = jnp.broadcast_to(variance, (8,))[:width]
        return jnp.maximum(jnp.broadcast_to(variance, (width,)), _LEAST_VARIANCE)

    def _corrected(
        self, state: KalmanState, covariance: Covariance, i: int, delivery: Received
    ) -> tuple[KalmanState, Covariance, Float[Array, " states"]]:
        """State and covariance with a reading, entry by entry; as they are where it is rejected or there is none.

        And the variances that a reading adds which is rejected, but tolerated.
        """
        sensor = self.sensors[i]
        reading = delivery.reading[:2] if isinstance(sensor, IMU) else delivery.reading
        states = error_states(self.sensors, MOTION_STATES)[i] if state.sensor_errors is not None else None
        expected, slopes = expected_reading(state, sensor, jnp.minimum(delivery.age, self.longest_delay), states)
        error = reading - expected
        for entry in sensor.angles:
            error = error.at[entry].add(-2 * jnp.pi * jnp.round(error[entry] / (2 * jnp.pi)))
        readable = jnp.abs(reading) <= _LARGEST_READING  # nor is one that is no number
        error, posterior = jnp.where(readable, error, 0.0), covariance
        correction, square, normalised = jnp.zeros(len(covariance)), jnp.zeros(()), []
        diagonal = np.eye(len(covariance), dtype=bool)
        # The noise of the entries is independent, so that one scalar update after the other is the update by all of
        # them, without the inverse of a matrix. Each subtracts the square of a vector: the covariance stays symmetric.
        for k, variance in enumerate(self.variance(sensor, len(reading))):
            shared = product(posterior, slopes[k])
            # No variance is negative, but the rounding errors of enormous ones may be.
            total = jnp.maximum((slopes[k] * shared).sum(), 0.0) + variance
            residual = error[k] - (slopes[k] * correction).sum()
            gain, share = shared / jnp.sqrt(total), jnp.where(readable[k], 1.0, 0.0)
            square = square + share * residual**2 / total
            normalised.append(share * residual / jnp.sqrt(total))
            correction = correction + share * residual / total * shared
            posterior = posterior - share * gain[:, None] * gain[None, :]
            # No variance is below what the reading's noise leaves.
            least_variance = share * (gain**2 / total) * variance
            posterior = jnp.where(diagonal, jnp.maximum(posterior, least_variance[:, None]), posterior)
        count = jnp.where(readable, 1.0, 0.0).sum()
        delivered = delivery.fresh & (count > 0)
        gate = self.gate**2 * count
        accepted = delivered & (square <= gate)
        period = sensor.sampling.period
        tolerated = delivered & ~accepted & (square <= gate * state.disagreement.tolerance[i])
        disagreement = state.disagreement.after(i, accepted, delivered, square / jnp.maximum(count, 1.0), period)
        # One reading far away says nothing of the others: it counts as at the gate.
        largest_innovation = self.gate * jnp.sqrt(jnp.maximum(count, 1.0))
        innovation = jnp.clip(jnp.stack(normalised), -largest_innovation, largest_innovation)
        innovation = jnp.where(jnp.isnan(innovation), largest_innovation, innovation)
        monitor = state.monitor.updated(i, innovation, count, delivered, period)
        correction = jnp.where(accepted, correction, 0.0)
        turn = quaternion_of_turn(correction[ATTITUDE])
        turned = quaternion_product(turn, state.attitude)
        after = state._replace(
            position=state.position + correction[POSITION],
            velocity=matvec(rotation_from_quaternion(turn), state.velocity + correction[VELOCITY]),
            attitude=turned / jnp.sqrt((turned * turned).sum()),
            gyro_bias=state.gyro_bias + correction[GYRO_BIAS],
            force_bias=state.force_bias + correction[FORCE_BIAS],
            disagreement=disagreement,
            rejected=state.rejected + jnp.where(delivered & ~accepted, 1, 0),
            monitor=monitor,
            sensor_errors=None if state.sensor_errors is None else state.sensor_errors + correction[MOTION_STATES:],
        )
        opened = jnp.where(tolerated, distrusted(covariance, slopes, error), 0.0)
        return after, jnp.where(accepted, posterior, covariance), opened


_DEVIATIONS = (
    "position_deviation",
    "velocity_deviation",
    "tilt_deviation",
    "heading_deviation",
    "gyro_bias_deviation",
    "force_bias_deviation",
    "gate",
    "noise_scale",
)


def _turned(attitude: Quaternion, turn: Vector3) -> Quaternion:
    """The attitude after a turn about body axes, rad."""
    after = quaternion_product(attitude, quaternion_of_turn(turn))
    return after / jnp.sqrt((after * after).sum())


def _propellers(report: Any, sensor: PropellerSpeed, delivery: Received) -> Any:
    """Speeds as read; their rate of change is the difference of successive readings."""
    new = delivery.fresh & jnp.isfinite(delivery.reading)
    after = report._replace(speed=jnp.where(new, delivery.reading, report.speed))
    if report.acceleration is None:
        return after
    rate = (delivery.reading - report.speed) / sensor.sampling.period
    return after._replace(acceleration=jnp.where(new, rate, report.acceleration))


def kalman(
    sensors,
    position_deviation: float = 0.1,
    velocity_deviation: float = 0.05,
    tilt_deviation: float = 0.02,
    heading_deviation: float = 0.05,
    gyro_bias_deviation: float = 5e-3,
    force_bias_deviation: float = 0.05,
    gyro_drift: float = 1e-5,
    force_drift: float = 1e-4,
    gate: float = 5.0,
    noise_scale: float = 1.0,
    longest_delay: float | None = None,
    sensor_error_states: bool = True,
    authority=None,
    inertial_factor: float = 2.0,
    largest_rate: float = 10.0,
) -> SensorNavigation:
    """Navigation of a vehicle from its sensors, by an error-state Kalman filter. For the sampled loop.

    It estimates position, velocity, attitude and the biases of gyroscopes and accelerometers, with their covariance.
    Defaults are those of cheap MEMS devices.

    Args:
        sensors: any; an IMU must be among them.
        position_deviation: initial standard deviation of the position, m.
        velocity_deviation: of the velocity, m/s.
        tilt_deviation: of roll and pitch, rad.
        heading_deviation: of the heading, rad.
        gyro_bias_deviation: of the biases of the gyroscopes, rad/s.
        force_bias_deviation: of the biases of the accelerometers, m/s^2.
        gyro_drift: random walk of the biases of the gyroscopes, rad/s per square root of a second.
        force_drift: likewise of the accelerometers, m/s^2 per square root of a second.
        gate: standard deviations beyond which a reading is rejected.
        noise_scale: standard deviations that the filter assumes, over those of the sensors.
        longest_delay: age of readings back to which the motion is kept, s; older ones are taken to be of that age. None
            for twice the longest delay of the sensors, at least half a second.
        sensor_error_states: whether the correlated errors of the sensors, iron and currents of a compass included, are
            states of the filter. Without, it neglects them.
        authority: acceleration that the thrusters can give along and about the axes of the body, m/s^2 and rad/s^2; six
            numbers, 0 for one that is not known. It bounds how fast samples of the IMU change. None for that of the
            nominal model in a scenario, and for unknown elsewhere (20 m/s^2, 100 rad/s^2).
        inertial_factor: largest acceleration of the vehicle over that of the thrusters.
        largest_rate: angular rate beyond which no sample is believed, rad/s.
    """
    sensors = tuple(sensors)
    check_sensors(sensors)
    delays = [np.asarray(sensor.sampling.delay) for sensor in sensors]
    longest: Any = max(_USUAL_DELAY, 2 * max(delays)) if longest_delay is None else longest_delay
    of_motion = position_deviation, velocity_deviation, tilt_deviation, heading_deviation
    of_biases = gyro_bias_deviation, force_bias_deviation, gyro_drift, force_drift
    gates = gate_for(authority, inertial_factor, largest_rate)
    filter = Kalman(sensors, gates, *of_motion, *of_biases, gate, noise_scale, longest, sensor_error_states)
    return SensorNavigation(filter=filter)
