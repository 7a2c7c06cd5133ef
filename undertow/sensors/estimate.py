"""True motion, as sensors measure it, and the estimate of the observer."""

from typing import Any, NamedTuple

import jax.numpy as jnp
from jaxtyping import Array, Float

from undertow.core.arrays import as_array
from undertow.core.contracts import Measurement
from undertow.core.measurement import body_of, measurement_of_pose
from undertow.numerics.linear_algebra import matvec
from undertow.numerics.number import Number
from undertow.numerics.rotations import (
    Matrix3,
    Quaternion,
    Vector3,
    euler_from_rotation,
    quaternion_from_euler,
    quaternion_rate,
    rotation_from_quaternion,
)
from undertow.sensors.sampling import Sampling


def gravity() -> Vector3:
    """Gravity, which accelerometers measure and the observer subtracts, m/s^2, world."""
    return as_array((0.0, 0.0, 9.81))  # made at use, in the precision of the run


class Motion(NamedTuple):
    """True motion at one instant."""

    position: Vector3  # m, world
    angles: Vector3  # rad, Euler
    rotation: Matrix3  # body -> world
    velocity: Vector3  # m/s, world
    rates: Vector3  # rad/s, body
    specific_force: Vector3  # m/s^2, body: as of an accelerometer, the mean since the previous instant
    actuator: Any  # report of the thrusters, or None


class Estimate(NamedTuple):
    """Estimate of the observer."""

    position: Vector3  # m, world
    attitude: Quaternion  # body -> world
    velocity: Vector3  # m/s, world
    rates: Vector3  # rad/s, body
    acceleration: Vector3  # m/s^2, world
    actuator: Any

    def measurement(self) -> Measurement:
        """Outputs of the plant and their rates, for a controller."""
        nu = jnp.concatenate([matvec(self.rotation().T, self.velocity), self.rates])
        return measurement_of_pose(self.position, self.attitude, nu, self.actuator)

    def predicted(self, elapsed: Number) -> "Estimate":
        """The estimate `elapsed` (s) later, with constant rates and acceleration."""
        turned = self.attitude + elapsed * quaternion_rate(self.attitude, self.rates)
        return self._replace(
            position=self.position + elapsed * self.velocity + elapsed**2 / 2 * self.acceleration,
            attitude=turned / jnp.sqrt((turned * turned).sum()),
            velocity=self.velocity + elapsed * self.acceleration,
        )

    def turned(self, angles: Vector3, share) -> "Estimate":
        """The estimate with its attitude turned by a share of the way towards Euler angles (rad)."""
        there = quaternion_from_euler(angles)
        aligned = jnp.where((there * self.attitude).sum() < 0, -there, there)
        between = (1 - share) * self.attitude + share * aligned
        return self._replace(attitude=between / jnp.sqrt((between * between).sum()))

    def angles(self) -> Vector3:
        """Euler angles, rad."""
        return euler_from_rotation(self.rotation())

    def rotation(self) -> Matrix3:
        """Body -> world."""
        return rotation_from_quaternion(self.attitude)

    def fixed(self, axes: slice, reading: Float[Array, " k"], sampling: Sampling, share) -> "Estimate":
        """The estimate `moved` on some axes by a position that was read `sampling.delay` ago."""
        then = self.position[axes] - sampling.delay * self.velocity[axes]
        return self.moved(jnp.zeros(3).at[axes].set(reading - then), share, sampling.period)

    def moved(self, error: Vector3, share, period) -> "Estimate":
        """Position and velocity corrected by an error of position (m): an alpha-beta filter.

        beta = alpha^2 / (2 - alpha) is that of Benedict and Bordner (1962), optimal for a given noise.
        """
        beta = share**2 / (2 - share)
        return self._replace(position=self.position + share * error, velocity=self.velocity + beta / period * error)


def motion_of(truth: Measurement, velocity_before: Vector3, elapsed) -> Motion:
    """True motion for the sensors.

    Args:
        truth: outputs (m, rad) of a body and their rates.
        velocity_before: of the body in the world at the previous instant, m/s.
        elapsed: time since then, s; zero at the start.
    """
    body, velocity = body_of(truth), truth.velocity[:3]
    acceleration = jnp.where(elapsed > 0, (velocity - velocity_before) / jnp.where(elapsed > 0, elapsed, 1.0), 0.0)
    force = matvec(body.rotation.T, acceleration - gravity())
    return Motion(truth.position[:3], truth.position[3:], body.rotation, velocity, body.nu[3:], force, truth.actuator)


def estimate_of(truth: Measurement) -> Estimate:
    """The true state as an estimate, for the start."""
    motion = motion_of(truth, truth.velocity[:3], jnp.zeros(()))
    return Estimate(
        motion.position, body_of(truth).attitude, motion.velocity, motion.rates, jnp.zeros(3), motion.actuator
    )
