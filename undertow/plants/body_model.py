"""What a controller may know of a vehicle, in body axes: no Euler angles inside, so no singularity and no unwinding."""

from typing import Any

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Float

from undertow.core.contracts import AbstractCoordinates, AbstractDynamics, Measurement, Target, TrackingError
from undertow.core.measurement import body_of, measurement_of_outputs
from undertow.core.status import Status
from undertow.numerics.linear_algebra import matvec
from undertow.numerics.rotations import (
    Kinematics,
    attitude_error,
    cross,
    rotation_from_quaternion,
    turning_from_euler,
)
from undertow.vehicles.body import Body

Vector6 = Float[Array, "6"]

EULER_ANGLES = (False, False, False, True, True, True)


class BodyDynamics(AbstractDynamics):
    """nu_dot = F + M^-1 B f + d with f the thrusts, N: section X5 of the theory. J and J_dot do not appear."""

    body: Body
    acceleration_per_thrust: Float[Array, "6 N"]  # M^-1 B
    allocation: Float[Array, "N 6"]  # inverse of M^-1 B; what no thruster can give is not asked for

    def drift(self, y: Measurement) -> Vector6:
        own = body_of(y)
        return self.body.free_acceleration(own.nu, own.rotation[2])

    def gain(self, y: Measurement) -> Float[Array, "6 N"]:
        return self.acceleration_per_thrust

    def invert(self, y: Measurement, acceleration: Vector6) -> Float[Array, " N"]:
        return matvec(self.allocation, acceleration)


class BodyCoordinates(AbstractCoordinates):
    """Errors in body axes: position (m), and attitude as a rotation vector (rad), the short way round; velocity nu."""

    angles: tuple[bool, ...] = eqx.field(static=True, default=EULER_ANGLES)
    tolerated_status: tuple[Status, ...] = eqx.field(static=True, default=(Status.PITCH_SINGULAR,))

    def measurement(self, position: Vector6, velocity: Vector6, actuator: Any = None) -> Measurement:
        return measurement_of_outputs(position, velocity, actuator)

    def tracking_error(self, y: Measurement, r: Target) -> TrackingError:
        """The target as the vehicle sees it in its own axes: where, how fast, and the time derivative of that."""
        own = body_of(y)
        to_body = own.rotation.T
        attitude, rate, turning = turning_from_euler(r.position[3:], r.velocity[3:], r.acceleration[3:])
        between = to_body @ rotation_from_quaternion(attitude)
        rate, turning = matvec(between, rate), matvec(between, turning)
        velocity = matvec(to_body, r.velocity[:3])
        acceleration = matvec(to_body, r.acceleration[:3]) - cross(own.nu[3:], velocity)
        there = matvec(to_body, r.position[:3] - y.position[:3])
        return TrackingError(
            error=jnp.concatenate([there, attitude_error(attitude, own.attitude)]),
            rate=jnp.concatenate([velocity, rate]) - own.nu,
            acceleration=jnp.concatenate([acceleration, turning - cross(own.nu[3:], rate)]),
        )

    def velocity(self, y: Measurement) -> Vector6:
        return body_of(y).nu

    def acceleration(self, y: Measurement, acceleration: Vector6) -> Vector6:
        """nu_dot of an acceleration of the outputs."""
        own = body_of(y)
        kinematics = Kinematics(own.rotation)
        return kinematics.to_body(acceleration - kinematics.rate_term(own.nu))

    def output_velocity(self, y: Measurement, velocity: Vector6) -> Vector6:
        return Kinematics(body_of(y).rotation).to_world(velocity)

    def in_body_axes(self, dynamics: AbstractDynamics) -> None:
        return None
