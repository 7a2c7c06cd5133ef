"""Formats of a measured motion: attitude as quaternion or Euler angles, velocity in body or world axes or as rates."""

from typing import Any, NamedTuple

import jax.numpy as jnp
from jaxtyping import Array, Float

from undertow.core import checks
from undertow.core.contracts import AbstractCoordinates, BodyMotion, Measurement
from undertow.core.errors import BadInput
from undertow.core.measurement import BODY_OUTPUTS, measurement_of_outputs, measurement_of_pose
from undertow.core.numerics.linear_algebra import matvec
from undertow.core.numerics.rotations import (
    Kinematics,
    euler_from_rotation,
    quaternion_from_euler,
    rotation_from_quaternion,
)

Vector3 = Float[Array, "3"]

_QUATERNION = ("w", "x", "y", "z")
_BODY = ("u", "v", "w", "p", "q", "r")
_WORLD = ("v_north", "v_east", "v_down", "omega_north", "omega_east", "omega_down")
_RATES = tuple(f"{name}_rate" for name in BODY_OUTPUTS)

# Names of the numbers of each format.
_ATTITUDES = {"euler": BODY_OUTPUTS[3:], "quaternion": _QUATERNION, "both": (*BODY_OUTPUTS[3:], *_QUATERNION)}
_VELOCITIES = {"body": _BODY, "world": _WORLD, "rates": _RATES, "both": (*_RATES, *_BODY)}
ATTITUDES, VELOCITIES = tuple(_ATTITUDES), tuple(_VELOCITIES)

AS_INTEGRATED = 1e-6  # a quaternion whose square departs from 1 by less, as in a simulation, is taken as it is


class Format(NamedTuple):
    """Format of the measured motion of a vehicle.

    Attributes:
        attitude: `euler` (roll, pitch, yaw, rad), `quaternion` (w, x, y, z, body -> world), or `both` in this order.
        velocity: `body` (surge, sway, heave, p, q, r), `world` (velocity and angular velocity in world axes), `rates`
            (of north, east, down and of the Euler angles), or `both` rates and body; m/s and rad/s.

    `both` and `both` belong together: they are all that a navigation filter knows, and nothing is computed of them, so
    that a controller has the bits of a simulation with any navigation.
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
        if (self.attitude == "both") != (self.velocity == "both"):
            raise BadInput("attitude", "be `both` where velocity is, and only there", self.attitude)

    def columns(self) -> "MeasuredMotion":
        """Names of the numbers of a motion."""
        return MeasuredMotion(BODY_OUTPUTS[:3], _ATTITUDES[self.attitude], _VELOCITIES[self.velocity])

    def measurement(self, motion: "MeasuredMotion", actuator: Any) -> Measurement:
        """The measurement of a body from its motion in this format."""
        position, attitude, velocity = motion
        if self.attitude == "both":
            rotation = rotation_from_quaternion(attitude[3:])
            body = BodyMotion(attitude[3:], rotation, velocity[6:])
            return Measurement(jnp.concatenate([position, attitude[:3]]), velocity[:6], actuator, body)
        if self.attitude == "euler" and self.velocity == "rates":
            return measurement_of_outputs(jnp.concatenate([position, attitude]), velocity, actuator)
        if self.attitude == "quaternion":
            quaternion = _unit(attitude)
            rotation = rotation_from_quaternion(quaternion)
            angles = euler_from_rotation(rotation)
        else:
            quaternion = quaternion_from_euler(attitude)
            angles = attitude
            rotation = rotation_from_quaternion(quaternion)
        if self.velocity == "rates":
            rates = velocity
            nu = Kinematics(rotation).to_body(velocity)
        else:
            nu = velocity if self.velocity == "body" else _in_body_axes(rotation, velocity)
            rates = Kinematics(rotation).to_world(nu)
        if self.attitude == "quaternion" and self.velocity == "body":
            return measurement_of_pose(position, quaternion, nu, actuator)
        outputs = jnp.concatenate([position, angles])
        return Measurement(outputs, rates, actuator, BodyMotion(quaternion, rotation, nu))


class MeasuredMotion(NamedTuple):
    """A measured motion: that of a vehicle in a `Format`, or the outputs of another plant and their rates."""

    position: Any  # m, north, east, down; or all outputs
    attitude: Any  # of no length for a plant that is no vehicle
    velocity: Any

    def measurement(self, coordinates: AbstractCoordinates, form: Format | None, actuator: Any) -> Measurement:
        """As a controller takes it; `form` is None for a plant that is no vehicle."""
        if form is None:
            return coordinates.measurement(self.position, self.velocity, actuator)
        return form.measurement(self, actuator)


def motion_in(form: Format | None, measurement: Measurement) -> MeasuredMotion:
    """A measurement as a motion in a format: what `MeasuredMotion.measurement` turns back."""
    position, velocity, body = measurement.position, measurement.velocity, measurement.body
    if form is None or body is None:
        return MeasuredMotion(position, jnp.zeros(0), velocity)
    world = jnp.concatenate([matvec(body.rotation, body.nu[:3]), matvec(body.rotation, body.nu[3:])])
    attitudes = {
        "euler": position[3:],
        "quaternion": body.attitude,
        "both": jnp.concatenate([position[3:], body.attitude]),
    }
    velocities = {"body": body.nu, "world": world, "rates": velocity, "both": jnp.concatenate([velocity, body.nu])}
    return MeasuredMotion(position[:3], attitudes[form.attitude], velocities[form.velocity])


def _unit(quaternion: Float[Array, "4"]) -> Float[Array, "4"]:
    """The quaternion with length 1: as it is where that is so already."""
    square = (quaternion**2).sum()
    return jnp.where(jnp.abs(square - 1) < AS_INTEGRATED, quaternion, quaternion / jnp.sqrt(square))


def _in_body_axes(rotation: Float[Array, "3 3"], velocity: Float[Array, "6"]) -> Float[Array, "6"]:
    return jnp.concatenate([matvec(rotation.T, velocity[:3]), matvec(rotation.T, velocity[3:])])
