"""Measurements of a body, made from its pose or from its outputs; both are consistent."""

from typing import Any

import jax.numpy as jnp
from jaxtyping import Array, Float

from undertow.core.contracts import BodyMotion, Measurement
from undertow.core.errors import BadInput
from undertow.core.numerics.rotations import (
    Kinematics,
    euler_from_rotation,
    quaternion_from_euler,
    rotation_from_quaternion,
)

Vector6 = Float[Array, "6"]

BODY_OUTPUTS = ("north", "east", "down", "roll", "pitch", "yaw")
BODY_AXES = ("surge", "sway", "heave", "roll", "pitch", "yaw")


def measurement_of_pose(
    position: Float[Array, "3"], attitude: Float[Array, "4"], nu: Vector6, actuator: Any = None
) -> Measurement:
    """Measurement of a body from position (m), unit quaternion (body -> world) and velocity (body axes, m/s, rad/s)."""
    rotation = rotation_from_quaternion(attitude)
    outputs = jnp.concatenate([position, euler_from_rotation(rotation)])
    return Measurement(outputs, Kinematics(rotation).to_world(nu), actuator, BodyMotion(attitude, rotation, nu))


def measurement_of_outputs(position: Vector6, velocity: Vector6, actuator: Any = None) -> Measurement:
    """Measurement of a body from its outputs: north, east, down (m), Euler angles (rad), and their rates."""
    attitude = quaternion_from_euler(position[3:])
    rotation = rotation_from_quaternion(attitude)
    return Measurement(
        position, velocity, actuator, BodyMotion(attitude, rotation, Kinematics(rotation).to_body(velocity))
    )


def body_of(y: Measurement) -> BodyMotion:
    """Pose and velocity of a measured body.

    Raises:
        BadInput: the measurement holds outputs alone.
    """
    if y.body is None:
        hint = "Make it with `measurement_of_outputs` or `with_outputs` of undertow.core.measurement"
        raise BadInput("measurement", "hold the pose of a body", f"{y.position.shape[0]} outputs alone", hint=hint)
    return y.body


def with_pose(y: Measurement, truth: Measurement) -> Measurement:
    """Measurement of a navigation filter, with the pose recomputed where the filter changed the outputs alone."""
    if truth.body is None or (y.position is truth.position and y.velocity is truth.velocity):
        return y
    return measurement_of_outputs(*y[:3]) if y.body is None or y.body is truth.body else y


def with_outputs(y: Measurement, position: Array, velocity: Array) -> Measurement:
    """The measurement of any plant with other outputs (m, rad) and rates, such as noisy ones."""
    if y.body is None:
        return y._replace(position=position, velocity=velocity)
    return measurement_of_outputs(position, velocity, y.actuator)._replace(health=y.health)
