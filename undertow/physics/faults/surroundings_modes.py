"""Modes of the plant: what the surroundings do to it."""

import jax.numpy as jnp
from jaxtyping import Float

from undertow.core import checks
from undertow.core.numerics.linear_algebra import matvec
from undertow.core.param import Param, param
from undertow.physics.disturbances.loads import body_of, with_force, with_water
from undertow.physics.faults.mode import AbstractPlantFault, Severity

_TINY = 1e-9  # m


class CurrentStep(AbstractPlantFault):
    """Uniform water of constant velocity from the onset on; the water does not accelerate gradually."""

    direction: Float[Param, "3"] = param("", "of the current, world axes")
    severity = Severity("speed of the water", "m/s", 0.5, -10.0, 10.0)

    def __check_init__(self):
        checks.length("direction", self.direction, 3, "north, east, down")
        checks.finite("direction", self.direction)

    def load(self, presence, pose, load):
        return with_water(load, pose, presence.size * self.direction, jnp.zeros(3))


def current_step(direction=(1.0, 0.0, 0.0)) -> CurrentStep:
    """A current that sets in at once.

    Args:
        direction: of length 1: north, east, down.
    """
    return CurrentStep(direction)


class WaveBurst(AbstractPlantFault):
    """Sinusoidal motion of uniform water, which begins and ends with it."""

    direction: Float[Param, "3"] = param("", "of the motion, world axes")
    period: Float[Param, ""] = param("s", "of the waves")
    severity = Severity("amplitude of the velocity of the water", "m/s", 0.5, 0.0, 10.0)
    default_duration = 10.0

    def __check_init__(self):
        checks.length("direction", self.direction, 3, "north, east, down")
        checks.finite("direction", self.direction)
        checks.positive("period", self.period, "s")

    def load(self, presence, pose, load):
        rate = 2 * jnp.pi / self.period
        speed, rise = jnp.sin(rate * presence.since), rate * jnp.cos(rate * presence.since)
        along = presence.size * self.direction
        return with_water(load, pose, speed * along, rise * along)


def wave_burst(direction=(1.0, 0.0, 0.0), period: float = 5.0) -> WaveBurst:
    """A group of waves, such as the wash of a ship.

    Args:
        direction: of length 1: north, east, down.
        period: of the waves, s.
    """
    return WaveBurst(direction, period)


class Shove(AbstractPlantFault):
    """A constant force in world axes at a point of the body."""

    direction: Float[Param, "3"] = param("", "of the force, world axes")
    point: Float[Param, "3"] = param("m", "where it acts, body axes")
    severity = Severity("force", "N", 50.0, -1e6, 1e6)
    default_duration = 1.0

    def __check_init__(self):
        checks.length("direction", self.direction, 3, "north, east, down")
        checks.length("point", self.point, 3, "forward, starboard, down")
        checks.finite("direction", self.direction)
        checks.finite("point", self.point, "m")

    def load(self, presence, pose, load):
        return with_force(load, pose, presence.size * self.direction, self.point)


def shove(direction=(1.0, 0.0, 0.0), point=(0.0, 0.0, 0.0)) -> Shove:
    """A push: a force for a second, unless a duration is given.

    Args:
        direction: of the force, of length 1: north, east, down.
        point: where it acts, m: forward, starboard, down.
    """
    return Shove(direction, point)


class ConstantMoment(AbstractPlantFault):
    """A constant moment in body axes."""

    direction: Float[Param, "3"] = param("", "of the moment, body axes")
    severity = Severity("moment", "N m", 10.0, -1e6, 1e6)
    default_duration = 1.0

    def __check_init__(self):
        checks.length("direction", self.direction, 3, "roll, pitch, yaw")
        checks.finite("direction", self.direction)

    def load(self, presence, pose, load):
        body_of(pose)
        moment = jnp.concatenate([jnp.zeros(3), presence.size * self.direction])
        return load._replace(wrench=load.wrench - moment)


def twist(direction=(0.0, 0.0, 1.0)) -> ConstantMoment:
    """A moment for a second, unless a duration is given.

    Args:
        direction: of length 1: roll, pitch, yaw in body axes.
    """
    return ConstantMoment(direction)


class Contact(AbstractPlantFault):
    """A plane that pushes the origin of the vehicle back by a stiff spring and a damper; it neither pulls nor rubs."""

    direction: Float[Param, "3"] = param("", "from free water into the obstacle, world axes")
    stiffness: Float[Param, ""] = param("N/m", "force per depth of penetration")
    damping: Float[Param, ""] = param("N s/m", "force per speed of penetration")
    severity = Severity("position of the obstacle along its direction", "m", -0.05, -1e6, 1e6)

    def __check_init__(self):
        checks.length("direction", self.direction, 3, "north, east, down")
        checks.finite("direction", self.direction)
        checks.not_negative("stiffness", self.stiffness, "N/m")
        checks.not_negative("damping", self.damping, "N s/m")

    def load(self, presence, pose, load):
        body = body_of(pose)
        depth = (self.direction * body.position).sum() - presence.severity
        push = self.stiffness * depth + self.damping * (self.direction * body.velocity).sum()
        force = jnp.where(presence.active & (depth > 0), jnp.maximum(push, 0.0), 0.0)
        return with_force(load, pose, -force * self.direction, jnp.zeros(3))


def contact(direction=(1.0, 0.0, 0.0), stiffness: float = 1000.0, damping: float = 200.0) -> Contact:
    """Contact with an obstacle: beyond a plane the vehicle is pushed back.

    Args:
        direction: from free water into the obstacle, of length 1: (0, 0, 1) for the bottom, (1, 0, 0) for a wall ahead.
        stiffness: N per m of penetration.
        damping: N per m/s of penetration.
    """
    return Contact(direction, stiffness, damping)


class TetherSnag(AbstractPlantFault):
    """An elastic cable to a fixed point, slack within its length, which pulls from the onset on."""

    anchor: Float[Param, "3"] = param("m", "where it is caught, world axes")
    point: Float[Param, "3"] = param("m", "attachment on the vehicle, body axes")
    length: Float[Param, ""] = param("m", "length that is free")
    severity = Severity("tension per extension", "N/m", 100.0, 0.0, 1e6)

    def __check_init__(self):
        checks.length("anchor", self.anchor, 3, "north, east, down")
        checks.length("point", self.point, 3, "forward, starboard, down")
        for name in ("anchor", "point"):
            checks.finite(name, getattr(self, name), "m")
        checks.not_negative("length", self.length, "m")

    def load(self, presence, pose, load):
        body = body_of(pose)
        span = self.anchor - body.position - matvec(body.rotation, self.point)
        distance = jnp.sqrt((span**2).sum() + _TINY**2)
        tension = presence.size * jnp.maximum(distance - self.length, 0.0)
        return with_force(load, pose, tension * span / distance, self.point)


def tether_snag(anchor=(-2.0, 0.0, 0.0), point=(0.0, 0.0, 0.0), length: float = 1.5) -> TetherSnag:
    """A tether that is caught at a fixed point.

    Args:
        anchor: where it is caught, m: north, east, down.
        point: attachment on the vehicle, m: forward, starboard, down.
        length: of the free part, m.
    """
    return TetherSnag(anchor, point, length)


PARTS = (current_step, wave_burst, shove, twist, contact, tether_snag)
