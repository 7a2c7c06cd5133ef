"""State of the error-state Kalman filter, and what a sensor would have read there."""

from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
from jaxtyping import Array, Float, Int

from undertow.control.navigation.consistency import InnovationConsistency
from undertow.control.navigation.disagreement import Disagreement
from undertow.control.navigation.inertial_covariance import MOTION_STATES, product
from undertow.control.navigation.inertial_gate import InertialMemory
from undertow.control.navigation.motion_history import MotionHistory
from undertow.core.numerics.linear_algebra import matvec
from undertow.core.numerics.number import Number
from undertow.core.numerics.rotations import (
    Quaternion,
    Vector3,
    conjugate,
    cross,
    euler_from_rotation,
    quaternion_product,
    rotation_from_quaternion,
    skew,
)
from undertow.physics.sensors.gauss_markov import ErrorValues
from undertow.physics.sensors.imu import IMU
from undertow.physics.sensors.motion import Motion, gravity
from undertow.physics.sensors.sensor import AbstractSensor, error_slopes


class KalmanState(NamedTuple):
    """State of the filter."""

    position: Vector3  # m, world
    attitude: Quaternion  # body -> world
    velocity: Vector3  # m/s, world
    gyro_bias: Vector3  # rad/s
    force_bias: Vector3  # m/s^2
    # Upper triangle, of the errors of attitude, gyro bias, velocity, force bias, position, and those of the sensors.
    covariance: Float[Array, " entries"]
    inertial: InertialMemory  # samples of gyroscopes, rad/s, and accelerometers, m/s^2
    actuator: Any
    history: MotionHistory
    disagreement: Disagreement
    rejected: Int[Array, ""]  # readings so far
    monitor: InnovationConsistency
    sensor_errors: ErrorValues | None = None  # correlated errors of all sensors; None where the filter has none

    @property
    def rates(self) -> Vector3:
        """Last believed reading of the gyroscopes, rad/s."""
        return self.inertial.values[:3]

    @property
    def force(self) -> Vector3:
        """Last believed reading of the accelerometers, m/s^2."""
        return self.inertial.values[3:]


def expected_reading(state: KalmanState, sensor: AbstractSensor, age: Number, of_errors: slice | None):
    """What a sensor would have read `age` (s) ago, and its slopes in the errors of now, [entries, states].

    What the biases changed in the meantime is not kept in the slopes: age^2 / 2 times a force bias, some millimetres in
    a second. With correlated errors that of the accelerometers is. Such errors are those of the reading that arrives: a
    delayed one is as correlated with the next.

    Args:
        state: of the filter.
        sensor: which.
        age: s.
        of_errors: states of the correlated errors of this sensor; None where those of no sensor are states.
    """
    past = state.history.at(age)
    turn_back = quaternion_product(conjugate(state.history.attitude), past.attitude)
    past_attitude = quaternion_product(state.attitude, turn_back)
    rotation, fallen = rotation_from_quaternion(past_attitude), age * gravity()
    estimated = jnp.zeros(0)
    if of_errors is not None and state.sensor_errors is not None:
        estimated = state.sensor_errors[of_errors.start - MOTION_STATES : of_errors.stop - MOTION_STATES]

    def read(errors):
        attitude_error, velocity_error, position_error = errors[:3], errors[3:6], errors[6:9]
        velocity = state.velocity + velocity_error + cross(attitude_error, state.velocity)
        turned = rotation + product(skew(attitude_error), rotation)
        # What accelerated the body since then is turned with it, gravity is not.
        displaced = past.displacement + cross(attitude_error, past.displacement - age / 2 * fallen)
        motion = Motion(
            position=state.position + position_error + displaced - age * velocity,
            angles=euler_from_rotation(turned),
            rotation=turned,
            velocity=velocity + past.velocity + cross(attitude_error, past.velocity + fallen),
            rates=state.rates - state.gyro_bias,
            specific_force=state.force - state.force_bias,
            actuator=state.actuator,
        )
        reading = sensor.reading(motion)
        if len(estimated):
            reading = reading + matvec(error_slopes(sensor, motion), estimated + errors[9:])
        return reading[:2] if isinstance(sensor, IMU) else reading

    none = jnp.zeros(9 + len(estimated))
    slopes, zero = jax.jacfwd(read)(none), jnp.zeros
    of = lambda errors: slopes[:, errors]
    rows = slopes.shape[0]
    blocks = [of(slice(0, 3)), zero((rows, 3)), of(slice(3, 6)), zero((rows, 3)), of(slice(6, 9))]
    if of_errors is not None and state.sensor_errors is not None:
        # Where tilt is known from the accelerometers alone, a late velocity without this would tell it from their bias.
        velocity_slope, position_slope = age * rotation, age**2 / 2 * rotation
        blocks[3] = product(of(slice(3, 6)), velocity_slope) + product(of(slice(6, 9)), position_slope)
        last = MOTION_STATES + len(state.sensor_errors)
        blocks += [
            zero((rows, of_errors.start - MOTION_STATES)),
            of(slice(9, None)),
            zero((rows, last - of_errors.stop)),
        ]
    return read(none), jnp.concatenate(blocks, axis=1)
