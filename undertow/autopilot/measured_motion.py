"""Formats of a measured motion: attitude as quaternion or Euler angles, velocity in body or world axes or as rates."""

from typing import Any, NamedTuple

import jax.numpy as jnp
from jaxtyping import Array, Float

from undertow.core import checks
from undertow.core.contracts import AbstractCoordinates, BodyMotion, Measurement
from undertow.core.measurement import measurement_of_outputs, measurement_of_pose
from undertow.numerics.linear_algebra import matvec
from undertow.numerics.rotations import Kinematics, euler_from_rotation, quaternion_from_euler, rotation_from_quaternion

Vector3 = Float[Array, "3"]

ATTITUDES = ("euler", "quaternion")
VELOCITIES = ("body", "world", "rates")

_UNIT = 1e-9  # a quaternion whose square departs from 1 by less is taken as it is: one that was integrated does


class Format(NamedTuple):
    """Format of the measured motion of a vehicle.

    Attributes:
        attitude: `euler` (roll, pitch, yaw, rad) or `quaternion` (w, x, y, z, body -> world).
        velocity: `body` (surge, sway, heave, p, q, r), `world` (velocity and angular velocity in world axes) or `rates`
            (of north, east, down and of the Euler angles); m/s and rad/s.
    """

    attitude: str = "euler"
    velocity: str = "body"

    def check(self) -> None:
        """Check both words.

        Raises:
            BadInput: there is no such format.
        """
        checks.choice("attitude", self.attitude, ATTITUDES)
        checks.choice("velocity", self.velocity, VELOCITIES)

    def measurement(self, motion: "Motion", actuator: Any) -> Measurement:
        """The measurement of a body from its motion in this format."""
        position, attitude, velocity = motion
        if self.attitude == "euler" and self.velocity == "rates":
            return measurement_of_outputs(jnp.concatenate([position, attitude]), velocity, actuator)
        if self.attitude == "quaternion":
            quaternion = _unit(attitude)
            rotation = rotation_from_quaternion(quaternion)
            angles = euler_from_rotation(rotation)
        else:
            quaternion, angles = quaternion_from_euler(attitude), attitude
            rotation = rotation_from_quaternion(quaternion)
        if self.velocity == "rates":
            rates, nu = velocity, Kinematics(rotation).to_body(velocity)
        else:
            nu = velocity if self.velocity == "body" else _in_body_axes(rotation, velocity)
            rates = Kinematics(rotation).to_world(nu)
        if self.attitude == "quaternion" and self.velocity == "body":
            return measurement_of_pose(position, quaternion, nu, actuator)
        outputs = jnp.concatenate([position, angles])
        return Measurement(outputs, rates, actuator, BodyMotion(quaternion, rotation, nu))


class Motion(NamedTuple):
    """A measured motion: that of a vehicle in a `Format`, or the outputs of another plant and their rates."""

    position: Any  # m, north, east, down; or all outputs
    attitude: Any  # of no length for a plant that is no vehicle
    velocity: Any

    def measurement(self, coordinates: AbstractCoordinates, form: Format | None, actuator: Any) -> Measurement:
        """As a controller takes it; `form` is None for a plant that is no vehicle."""
        if form is None:
            return coordinates.measurement(self.position, self.velocity, actuator)
        return form.measurement(self, actuator)


def _unit(quaternion: Float[Array, "4"]) -> Float[Array, "4"]:
    """The quaternion with length 1: as it is where that is so already."""
    square = (quaternion**2).sum()
    return jnp.where(jnp.abs(square - 1) < _UNIT, quaternion, quaternion / jnp.sqrt(square))


def _in_body_axes(rotation: Float[Array, "3 3"], velocity: Float[Array, "6"]) -> Float[Array, "6"]:
    return jnp.concatenate([matvec(rotation.T, velocity[:3]), matvec(rotation.T, velocity[3:])])
