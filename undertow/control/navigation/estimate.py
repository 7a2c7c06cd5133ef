"""Estimate of a motion, integrated from rates and acceleration."""

from typing import Any, NamedTuple

import jax.numpy as jnp

from undertow.core.contracts import Measurement
from undertow.core.measurement import body_of, measurement_of_pose
from undertow.core.numerics.linear_algebra import matvec
from undertow.core.numerics.number import Number
from undertow.core.numerics.rotations import (
    Matrix3,
    Quaternion,
    Vector3,
    euler_from_rotation,
    quaternion_rate,
    rotation_from_quaternion,
)


class Estimate(NamedTuple):
    """Estimated motion."""

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

    def angles(self) -> Vector3:
        """Euler angles, rad."""
        return euler_from_rotation(self.rotation())

    def rotation(self) -> Matrix3:
        """Body -> world."""
        return rotation_from_quaternion(self.attitude)


def estimate_of(truth: Measurement) -> Estimate:
    """The true state as an estimate, for the start; of a body that is not accelerated."""
    body = body_of(truth)
    still = jnp.zeros(3)
    return Estimate(truth.position[:3], body.attitude, truth.velocity[:3], body.nu[3:], still, truth.actuator)
