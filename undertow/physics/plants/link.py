"""An elastic link between points of two bodies: a tether, which only pulls, or a bar with a joint at each end."""

from typing import NamedTuple

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Float

from undertow.core import checks
from undertow.core.numerics.linear_algebra import matvec
from undertow.core.numerics.rotations import cross
from undertow.core.param import Param, param

KINDS = ("tether", "bar", "none")
_TINY = 1e-9  # m

Vector3 = Float[Array, "3"]
Scalar = Float[Array, ""]


class Place(NamedTuple):
    """Position and velocity of a body whose points a link joins."""

    position: Vector3  # m, world
    rotation: Float[Array, "3 3"]  # body -> world
    nu: Float[Array, "6"]  # m/s, rad/s, body axes


class LinkForces(NamedTuple):
    """What a link does at an instant."""

    tension: Scalar  # N; negative where a bar is pressed
    extension: Scalar  # m; negative where a tether is slack
    rate: Scalar  # of the extension, m/s
    first: Float[Array, "6"]  # wrench on the first body, N, N m, its body axes
    second: Float[Array, "6"]  # likewise on the second


class SpringDamper(eqx.Module):
    """Straight spring and damper: tension k x + c x_dot at an extension x. A tether pulls only, and only where x > 0.

    Its mass, weight and drag are neglected. Forces on both bodies are equal and opposite, along the line between the
    two points. The energy that it takes from the bodies is stored as k x^2 / 2 or lost: the damper never gives any,
    nor does the limit of a tether, which holds the tension at zero while it shortens.

    Raises:
        BadInput: an unknown kind, length or stiffness not positive, damping negative.
    """

    first_point: Float[Param, "3"] = param("m", "attachment on the first body, body axes")
    second_point: Float[Param, "3"] = param("m", "attachment on the second body, body axes")
    length: Float[Param, ""] = param("m", "length without load", symbol="l_0")
    stiffness: Float[Param, ""] = param("N/m", "tension per extension", symbol="k")
    damping: Float[Param, ""] = param("N s/m", "tension per rate of extension", symbol="c")
    kind: str = eqx.field(static=True, default="tether")

    def __check_init__(self):
        checks.choice("kind", self.kind, KINDS)
        for name in ("first_point", "second_point"):
            checks.length(name, getattr(self, name), 3, "forward, starboard, down")
            checks.finite(name, getattr(self, name), "m")
        checks.positive("length", self.length, "m")
        checks.positive("stiffness", self.stiffness, "N/m")
        checks.not_negative("damping", self.damping, "N s/m")

    def forces(self, first: Place, second: Place) -> LinkForces:
        """Tension, extension and wrenches for the motion of two bodies."""
        span = second.position - first.position
        span = span + matvec(second.rotation, self.second_point) - matvec(first.rotation, self.first_point)
        distance = jnp.sqrt((span * span).sum() + _TINY**2)
        along = span / distance
        opening = _velocity(second, self.second_point) - _velocity(first, self.first_point)
        extension, rate = distance - self.length, (along * opening).sum()
        tension = self.stiffness * extension + self.damping * rate
        if self.kind == "tether":
            tension = jnp.where(extension > 0, jnp.maximum(tension, 0.0), 0.0)
        if self.kind == "none":
            tension = jnp.zeros_like(tension)
        pull = tension * along
        return LinkForces(
            tension, extension, rate, _wrench(first, self.first_point, pull), _wrench(second, self.second_point, -pull)
        )

    def energy(self, extension: Scalar) -> Scalar:
        """Elastic energy at an extension, J."""
        if self.kind == "none":
            return jnp.zeros_like(extension)
        stretched = jnp.maximum(extension, 0.0) if self.kind == "tether" else extension
        return self.stiffness * stretched**2 / 2

    def loss(self, found: LinkForces) -> Scalar:
        """Power that damper and limit of the tension take, W; never negative."""
        stretched = jnp.maximum(found.extension, 0.0) if self.kind == "tether" else found.extension
        elastic = jnp.zeros_like(stretched) if self.kind == "none" else self.stiffness * stretched
        return (found.tension - elastic) * found.rate


def _velocity(body: Place, point: Vector3) -> Vector3:
    """Velocity of a point of a body, world axes, m/s."""
    return matvec(body.rotation, body.nu[:3] + cross(body.nu[3:], point))


def _wrench(body: Place, point: Vector3, force: Vector3) -> Float[Array, "6"]:
    """Wrench of a force (N, world axes) at a point of a body."""
    own = matvec(body.rotation.T, force)
    return jnp.concatenate([own, cross(point, own)])
