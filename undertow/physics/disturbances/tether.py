"""A cable to a fixed point: slack, or elastic under tension."""

import jax.numpy as jnp
from jaxtyping import Float

from undertow.core import checks
from undertow.core.contracts import Load
from undertow.core.numerics.linear_algebra import matvec
from undertow.core.param import Param, param
from undertow.physics.disturbances.loads import AbstractSmoothDisturbance, body_of, with_force

_TINY = 1e-9  # m


class Tether(AbstractSmoothDisturbance):
    """Straight elastic cable from a fixed point to the vehicle, with the drag of half its length on the vehicle.

    Its inertia, weight and catenary are neglected; its drag assumes water at rest.

    Raises:
        BadInput: length or stiffness not positive, drag negative.
    """

    anchor: Float[Param, "3"] = param("m", "fixed end, world axes")
    point: Float[Param, "3"] = param("m", "attachment on the vehicle, body axes")
    length: Float[Param, ""] = param("m", "length without load", symbol="l_0")
    stiffness: Float[Param, ""] = param("N/m", "tension per extension", symbol="k")
    drag: Float[Param, ""] = param("N s^2/m^3", "drag per length and speed squared, rho C_d d / 2")

    def __check_init__(self):
        for name, what in (("anchor", "north, east, down"), ("point", "forward, starboard, down")):
            checks.length(name, getattr(self, name), 3, what)
            checks.finite(name, getattr(self, name), "m")
        checks.positive("length", self.length, "m")
        checks.positive("stiffness", self.stiffness, "N/m")
        checks.not_negative("drag", self.drag, "N s^2/m^3")

    def at(self, realization, t, pose, load: Load) -> Load:
        body = body_of(pose)
        span = self.anchor - body.position - matvec(body.rotation, self.point)
        distance = jnp.sqrt((span**2).sum() + _TINY**2)
        tension = self.stiffness * jnp.maximum(distance - self.length, 0.0)
        speed = jnp.sqrt((body.velocity**2).sum() + _TINY**2)
        hanging = jnp.minimum(distance, self.length)
        force = tension * span / distance - 0.5 * self.drag * hanging * speed * body.velocity
        return with_force(load, pose, force, self.point)


def tether(anchor=(0.0, 0.0, -5.0), point=(0.0, 0.0, 0.0), length=20.0, stiffness=200.0, drag=4.0) -> Tether:
    """Cable from a fixed point to the vehicle.

    Args:
        anchor: fixed end, m: north, east, down.
        point: attachment on the vehicle, m: forward, starboard, down.
        length: length without load, m.
        stiffness: N of tension per m of extension.
        drag: N per m of cable and (m/s)^2; 4 for a cable of 7.6 mm with C_d 1.03.
    """
    return Tether(anchor, point, length, stiffness, drag)
