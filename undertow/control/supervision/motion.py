"""Motion of a plant as the supervisor compares it: of a vehicle without Euler angles, so that nothing is singular."""

from typing import NamedTuple

import jax.numpy as jnp
from jaxtyping import Array, Float

from undertow.core.contracts import AbstractCoordinates, Measurement, Outputs
from undertow.core.measurement import measurement_of_pose
from undertow.core.numerics.number import Number
from undertow.core.numerics.rotations import Kinematics, quaternion_rate

_LEAST = 1e-30  # far below the square of any length that matters


class MonitoredMotion(NamedTuple):
    """Motion of a vehicle, or the outputs of another plant and their rates."""

    position: Array  # m, world; or the outputs
    attitude: Array  # unit quaternion, body -> world; of no length for another plant
    velocity: Array  # m/s, rad/s, body axes; or the rates


def motion_of(y: Measurement) -> MonitoredMotion:
    """The motion that a measurement holds."""
    if y.body is None:
        return MonitoredMotion(y.position, jnp.zeros(0), y.velocity)
    return MonitoredMotion(y.position[:3], y.body.attitude, y.body.nu)


def with_motion(y: Measurement, motion: MonitoredMotion) -> Measurement:
    """The measurement with another motion."""
    if y.body is None:
        return y._replace(position=motion.position, velocity=motion.velocity)
    return measurement_of_pose(*motion, y.actuator)._replace(health=y.health)


def rate_of_velocity(y: Measurement, coordinates: AbstractCoordinates, acceleration: Outputs) -> Outputs:
    """Rate of `MonitoredMotion.velocity` for an acceleration in the coordinates of a model."""
    if y.body is None or coordinates.axes:
        return acceleration
    kinematics = Kinematics(y.body.rotation)
    return kinematics.to_body(acceleration - kinematics.rate_term(y.body.nu))


def predicted(y: Measurement, acceleration: Outputs, dt: Number) -> MonitoredMotion:
    """Motion dt (s) after a measurement, for a rate of `MonitoredMotion.velocity`."""
    motion = motion_of(y)
    attitude = motion.attitude
    if y.body is not None:
        turned = attitude + dt * quaternion_rate(attitude, y.body.nu[3:])
        attitude = turned / jnp.sqrt((turned * turned).sum())
    return MonitoredMotion(
        motion.position + dt * y.velocity[: motion.position.shape[0]], attitude, motion.velocity + dt * acceleration
    )


def length(vector: Array) -> Float[Array, ""]:
    """Length of a vector, with a gradient at zero, too."""
    return jnp.sqrt((vector * vector).sum() + _LEAST)


def split(motion_velocity: Float[Array, " n"]) -> tuple[Array, Array]:
    """Linear and angular part of a velocity of six entries; all and nothing of another plant's."""
    return (
        (motion_velocity[:3], motion_velocity[3:])
        if motion_velocity.shape == (6,)
        else (motion_velocity, motion_velocity[:0])
    )
