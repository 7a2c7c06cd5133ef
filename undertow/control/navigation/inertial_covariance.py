"""Covariance of the errors of strapdown inertial navigation, and how it spreads.

J. Sola, Quaternion kinematics for the error-state Kalman filter, arXiv 1711.02508 (2017), with attitude errors in world
axes.
"""

import jax.numpy as jnp
from jaxtyping import Array

from undertow.control.navigation.sensor_errors import Covariance
from undertow.core.numerics.linear_algebra import matvec
from undertow.core.numerics.number import Number
from undertow.core.numerics.rotations import Matrix3, Vector3, skew
from undertow.physics.sensors.motion import gravity

# Errors of the state, in world axes but for the biases; slices of the covariance. That of the velocity is the error of
# the velocity in body axes, turned: the truth is exp(attitude error) (velocity + error). So what a DVL reads does not
# depend on the heading, and noise in the estimated velocity tells the filter nothing about the heading. (With the error
# of the velocity in world axes it does, and a filter without a compass believes in a heading that nothing measured.)
ATTITUDE, GYRO_BIAS, VELOCITY, FORCE_BIAS, POSITION = (slice(3 * i, 3 * i + 3) for i in range(5))
MOTION_STATES = 15  # correlated errors of the sensors follow


def spread(
    covariance: Covariance,
    h: Number,
    rotation: Matrix3,
    velocity: Vector3,
    of_inertial: tuple[Vector3, Vector3],
    of_biases: tuple[Number, Number],
) -> Covariance:
    """The covariance h (s) later. Half steps before and after make products of matrices of second order in h.

    Args:
        covariance: of before.
        h: s.
        rotation: body -> world, in the middle.
        velocity: m/s, world.
        of_inertial: densities of the noise of gyroscopes, (rad/s)^2 s, and accelerometers, (m/s^2)^2 s.
        of_biases: the same of the rates of change of their biases.
    """
    of_rates, of_force = of_inertial
    of_gyro_bias, of_force_bias = of_biases
    across = skew(velocity)

    def half(p: Covariance) -> Covariance:
        p = _sheared(p, POSITION, VELOCITY, h / 2 * jnp.eye(3))
        p = _sheared(p, POSITION, ATTITUDE, -h / 2 * across)
        p = _sheared(p, ATTITUDE, GYRO_BIAS, -h / 2 * rotation)
        return _sheared(p, VELOCITY, GYRO_BIAS, -h / 2 * product(across, rotation))

    covariance = _sheared(half(covariance), VELOCITY, ATTITUDE, h * skew(gravity()))
    covariance = half(_sheared(covariance, VELOCITY, FORCE_BIAS, -h * rotation))
    in_world = lambda density: (rotation[:, None, :] * rotation[None, :, :] * density[None, None, :]).sum(-1)
    turning = in_world(of_rates)
    sideways = product(across, turning)  # noise of the gyroscopes turns the velocity in body axes
    noise = jnp.zeros(covariance.shape)
    noise = noise.at[ATTITUDE, ATTITUDE].set(turning).at[GYRO_BIAS, GYRO_BIAS].set(of_gyro_bias * jnp.eye(3))
    noise = noise.at[VELOCITY, ATTITUDE].set(sideways).at[ATTITUDE, VELOCITY].set(sideways.T)
    noise = noise.at[VELOCITY, VELOCITY].set(in_world(of_force) - product(sideways, across))
    return covariance + h * noise.at[FORCE_BIAS, FORCE_BIAS].set(of_force_bias * jnp.eye(3))


def product(a: Array, b: Array) -> Array:
    """Product of a small matrix with a vector or a matrix, without a call of a library."""
    if b.ndim == 1:
        return matvec(a, b)
    return (a[:, :, None] * b[None, :, :]).sum(1)


def _sheared(covariance: Covariance, to: slice, source: slice, matrix: Matrix3) -> Covariance:
    """Covariance where errors `to` have gained `matrix` times the errors `source`."""
    rows = covariance[to] + product(matrix, covariance[source])
    corner = rows[:, to] + product(rows[:, source], matrix.T)
    rows = rows.at[:, to].set((corner + corner.T) / 2)
    return covariance.at[to].set(rows).at[:, to].set(rows.T)
