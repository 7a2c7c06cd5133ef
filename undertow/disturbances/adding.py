"""How loads add up."""

from typing import Any

import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from undertow.core.contracts import AbstractDisturbance, Factors, Load, Payload, Place, Water
from undertow.core.errors import BadInput
from undertow.numerics.linear import matvec
from undertow.numerics.rotations import cross

Vector3 = Float[Array, "3"]


class Together(AbstractDisturbance):
    """Several disturbances at once, each with randomness of its own."""

    members: tuple[AbstractDisturbance, ...]

    def draw(self, key) -> tuple[Any, ...]:
        return tuple(member.draw(jax.random.fold_in(key, i)) for i, member in enumerate(self.members))

    def at(self, path, t, place, calm: Load) -> Load:
        for member, own in zip(self.members, path, strict=True):
            calm = member.at(own, t, place, calm)
        return calm

    def jumps(self, duration: float) -> tuple[float, ...]:
        return tuple(sorted({t for member in self.members for t in member.jumps(duration)}))


def body_of(place: Place | None) -> Place:
    """The place of a body in water.

    Raises:
        BadInput: the plant is none.
    """
    if place is None:
        raise BadInput("disturbance", "act on a body in water", "used with another plant", hint="Use kind: sinusoid")
    return place


def with_water(calm: Load, place: Place | None, velocity: Vector3, acceleration: Vector3) -> Load:
    """Water that also moves with a velocity (m/s) and accelerates (m/s^2), world axes."""
    body_of(place)
    before = calm.water or Water(jnp.zeros(3), jnp.zeros(3))
    return calm._replace(water=Water(before.velocity + velocity, before.acceleration + acceleration))


def with_force(calm: Load, place: Place | None, force: Vector3, point: Vector3) -> Load:
    """A force (N, world axes) that also pulls at a point of the body (m, body axes)."""
    pull = matvec(body_of(place).rotation.T, force)
    return calm._replace(wrench=calm.wrench - jnp.concatenate([pull, cross(point, pull)]))


def with_factors(calm: Load, place: Place | None, factors: Factors) -> Load:
    """A body that also differs by these factors."""
    body_of(place)
    product = factors if calm.factors is None else Factors(*(a * b for a, b in zip(calm.factors, factors, strict=True)))
    return calm._replace(factors=product)


def with_payload(calm: Load, place: Place | None, payload: Payload) -> Load:
    """A body that also carries this."""
    body_of(place)
    return calm._replace(payloads=(*calm.payloads, payload))
