"""True motion of a vehicle, as sensors measure it."""

from typing import Any, NamedTuple

import jax.numpy as jnp

from undertow.core.arrays import as_array
from undertow.core.contracts import Measurement
from undertow.core.measurement import body_of
from undertow.core.numerics.linear_algebra import matvec
from undertow.core.numerics.rotations import Matrix3, Vector3, cross


def gravity() -> Vector3:
    """Gravity, which accelerometers measure and navigation subtracts, m/s^2, world."""
    return as_array((0.0, 0.0, 9.81))  # made at use, in the precision of the run


class Motion(NamedTuple):
    """Motion at one instant."""

    position: Vector3  # m, world
    angles: Vector3  # rad, Euler
    rotation: Matrix3  # body -> world
    velocity: Vector3  # m/s, world
    rates: Vector3  # rad/s, body
    specific_force: Vector3  # m/s^2, body: as of an accelerometer, the mean since the previous instant, in its axes
    actuator: Any  # report of the thrusters, or None


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
    force = force + elapsed / 2 * cross(body.nu[3:], force)  # in the axes of half the time ago, of which it is the mean
    return Motion(truth.position[:3], truth.position[3:], body.rotation, velocity, body.nu[3:], force, truth.actuator)
