"""Quantities as the controller receives them, after the navigation filter: read from a measurement, and replaced in it.

Of a body in water these are what its sensors would give: position in world axes, attitude as Euler angles, velocity
over ground and angular rate in body axes. A false attitude leaves the velocity in body axes as it is, as a Doppler log
measures it, and turns it falsely into world axes.
"""

import math
from collections.abc import Callable
from typing import Any, NamedTuple

import jax.numpy as jnp
from jaxtyping import Array, Float

from undertow.core.contracts import BodyMotion, Measurement
from undertow.core.measurement import body_of
from undertow.core.numerics.rotations import Kinematics, quaternion_from_euler, rotation_from_quaternion

Vector = Float[Array, " width"]


class Quantity(NamedTuple):
    """One quantity of a measurement.

    Attributes:
        unit: of its entries.
        size: usual size of an error, for the default severity.
        angles: whether its entries are angles, in rad.
        read: its value in a measurement.
        replaced: the measurement with another value of it.
    """

    unit: str
    size: float
    angles: bool
    read: Callable[[Measurement], Vector]
    replaced: Callable[[Measurement, Vector], Measurement]

    @property
    def turn(self) -> float:
        """After how much an entry repeats, rad; 0 for no angles."""
        return 2 * math.pi if self.angles else 0.0


def _with_position(y: Measurement, new: Vector) -> Measurement:
    return y._replace(position=jnp.concatenate([new, y.position[3:]]))


def _with_depth(y: Measurement, new: Vector) -> Measurement:
    return y._replace(position=jnp.concatenate([y.position[:2], new, y.position[3:]]))


def _with_attitude(y: Measurement, new: Vector) -> Measurement:
    nu, attitude = body_of(y).nu, quaternion_from_euler(new)
    rotation = rotation_from_quaternion(attitude)
    outputs = jnp.concatenate([y.position[:3], new])
    body = BodyMotion(attitude, rotation, nu)
    return y._replace(position=outputs, velocity=Kinematics(rotation).to_world(nu), body=body)


def _with_nu(y: Measurement, nu: Vector) -> Measurement:
    body = body_of(y)
    return y._replace(velocity=Kinematics(body.rotation).to_world(nu), body=body._replace(nu=nu))


def _with_speed(y: Measurement, new: Vector) -> Measurement:
    report: Any = y.actuator
    return y._replace(actuator=report._replace(speed=new))


OF_BODY = {
    "position": Quantity("m", 0.5, False, lambda y: y.position[:3], _with_position),
    "attitude": Quantity("rad", 0.2, True, lambda y: y.position[3:], _with_attitude),
    "velocity": Quantity(
        "m/s",
        0.2,
        False,
        lambda y: body_of(y).nu[:3],
        lambda y, new: _with_nu(y, jnp.concatenate([new, body_of(y).nu[3:]])),
    ),
    "angular_rate": Quantity(
        "rad/s",
        0.2,
        False,
        lambda y: body_of(y).nu[3:],
        lambda y, new: _with_nu(y, jnp.concatenate([body_of(y).nu[:3], new])),
    ),
    "depth": Quantity("m", 0.5, False, lambda y: y.position[2:3], _with_depth),
}

PROPELLER_SPEED = Quantity("rad/s", 30.0, False, lambda y: y.actuator.speed, _with_speed)

OF_OTHERS = {
    "position": Quantity("unit of the outputs", 0.1, False, lambda y: y.position, lambda y, n: y._replace(position=n)),
    "velocity": Quantity("of the outputs, 1/s", 0.1, False, lambda y: y.velocity, lambda y, n: y._replace(velocity=n)),
}


def quantities_of(y: Measurement) -> dict[str, Quantity]:
    """Quantities of a measurement, by name."""
    reported = {"propeller_speed": PROPELLER_SPEED} if hasattr(y.actuator, "speed") else {}
    return (OF_OTHERS if y.body is None else OF_BODY) | reported
