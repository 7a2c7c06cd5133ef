"""Modes of the plant: what changes the hull, its mass and its buoyancy."""

import jax.numpy as jnp
from jaxtyping import Float

from undertow.core import checks
from undertow.core.contracts import ModelScaling, Payload
from undertow.core.param import Param, param
from undertow.physics.disturbances.loads import with_payload, with_scaling
from undertow.physics.faults.mode import AbstractPlantFault, Severity

_GRAVITY = 9.81  # m/s^2


class Mass(AbstractPlantFault):
    """A point mass that weighs nothing in water, such as water that is carried along."""

    point: Float[Param, "3"] = param("m", "where it is, body axes")
    severity = Severity("mass", "kg", 5.0, 0.0, 1e6)

    def __check_init__(self):
        checks.length("point", self.point, 3, "forward, starboard, down")
        checks.finite("point", self.point, "m")

    def load(self, presence, pose, load):
        return with_payload(load, pose, Payload(presence.size, 0.0 * presence.size, self.point))


def mass(point=(0.1, 0.0, 0.0)) -> Mass:
    """Additional mass without weight in water, such as water that is carried along.

    Args:
        point: where it is, m: forward, starboard, down.
    """
    return Mass(point)


class Drag(AbstractPlantFault):
    """A factor on linear and quadratic damping."""

    severity = Severity("additional share of the damping", "", 1.0, -1.0, 100.0)

    def load(self, presence, pose, load):
        one = jnp.ones(())
        return with_scaling(load, pose, ModelScaling(one, 1 + presence.size, one, one))


def drag() -> Drag:
    """More drag, such as that of growth or of something that is towed."""
    return Drag()


class BuoyancyLoss(AbstractPlantFault):
    """A weight without mass."""

    point: Float[Param, "3"] = param("m", "where the buoyancy is lost, body axes")
    severity = Severity("lost buoyancy; negative for lost ballast", "N", 10.0, -1e6, 1e6)

    def __check_init__(self):
        checks.length("point", self.point, 3, "forward, starboard, down")
        checks.finite("point", self.point, "m")

    def load(self, presence, pose, load):
        return with_payload(load, pose, Payload(0.0 * presence.size, presence.size, self.point))


def buoyancy_loss(point=(0.1, 0.0, 0.0)) -> BuoyancyLoss:
    """Loss of buoyancy, such as a block of foam that has gone; a negative severity is ballast that was dropped.

    Args:
        point: where the buoyancy is lost, m: forward, starboard, down.
    """
    return BuoyancyLoss(point)


class Leak(AbstractPlantFault):
    """Water that collects at a point of the hull, at a constant rate until all of it has entered."""

    point: Float[Param, "3"] = param("m", "where the water collects, body axes")
    rise: Float[Param, ""] = param("s", "time in which it enters")
    severity = Severity("mass of the water in the end", "kg", 1.0, 0.0, 1e6)

    def __check_init__(self):
        checks.length("point", self.point, 3, "forward, starboard, down")
        checks.finite("point", self.point, "m")
        checks.positive("rise", self.rise, "s")

    def load(self, presence, pose, load):
        entered = presence.size * jnp.clip(presence.since / self.rise, 0.0, 1.0)
        return with_payload(load, pose, Payload(entered, _GRAVITY * entered, self.point))


def leak(point=(-0.1, 0.0, 0.0), rise: float = 10.0) -> Leak:
    """Leak: water enters the hull, which adds mass and takes buoyancy.

    Args:
        point: where the water collects, m: forward, starboard, down.
        rise: time in which it enters, s.
    """
    return Leak(point, rise)


class BallastShift(AbstractPlantFault):
    """A part of the mass inside the hull is at another place: weight, moments and inertia follow."""

    ballast: Float[Param, ""] = param("kg", "mass that moves")
    point: Float[Param, "3"] = param("m", "where it was, body axes")
    direction: Float[Param, "3"] = param("", "in which it moves, body axes")
    severity = Severity("distance", "m", 0.1, -10.0, 10.0)

    def __check_init__(self):
        checks.not_negative("ballast", self.ballast, "kg")
        for name in ("point", "direction"):
            checks.length(name, getattr(self, name), 3, "forward, starboard, down")
            checks.finite(name, getattr(self, name))

    def load(self, presence, pose, load):
        mass = jnp.where(presence.active, self.ballast, 0.0)
        there = Payload(mass, _GRAVITY * mass, self.point + presence.size * self.direction)
        return with_payload(with_payload(load, pose, there), pose, Payload(-mass, -_GRAVITY * mass, self.point))


def ballast_shift(ballast: float = 2.0, point=(0.0, 0.0, 0.0), direction=(1.0, 0.0, 0.0)) -> BallastShift:
    """Shift of the centre of gravity: ballast, or a battery, slides in the hull.

    Args:
        ballast: mass that moves, kg, which is a part of the vehicle.
        point: where it was, m: forward, starboard, down.
        direction: in which it moves, of length 1: forward, starboard, down.
    """
    return BallastShift(ballast, point, direction)


PARTS = (mass, drag, buoyancy_loss, leak, ballast_shift)
