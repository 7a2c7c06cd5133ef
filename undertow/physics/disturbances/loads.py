"""Sums of loads, and the base class of disturbances that are neither random nor jump."""

from typing import Any

import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from undertow.core.contracts import AbstractDisturbance, FreeSurface, Load, ModelScaling, Payload, Pose, Water
from undertow.core.errors import BadInput, error_location
from undertow.core.numerics.linear_algebra import matvec
from undertow.core.numerics.rotations import cross

Scalar = Float[Array, ""]
Vector3 = Float[Array, "3"]


class AbstractSmoothDisturbance(AbstractDisturbance):
    """A load that is not random and does not jump."""

    def realize(self, key) -> tuple[()]:
        return ()

    def jumps(self, duration: float) -> tuple[float, ...]:
        return ()


class SumOfDisturbances(AbstractDisturbance):
    """Several disturbances at once, each with a random key of its own."""

    members: tuple[AbstractDisturbance, ...]

    def realize(self, key) -> tuple[Any, ...]:
        keys = jax.random.split(key, len(self.members))
        return tuple(member.realize(own) for member, own in zip(self.members, keys, strict=True))

    def at(self, realization, t, pose, load: Load) -> Load:
        for i, (member, own) in enumerate(zip(self.members, realization, strict=True)):
            with error_location(f"[{i}]"):
                load = member.at(own, t, pose, load)
        return load

    def jumps(self, duration: float) -> tuple[float, ...]:
        return tuple(sorted({t for member in self.members for t in member.jumps(duration)}))


def body_of(pose: Pose | None) -> Pose:
    """The pose of a body in water.

    Raises:
        BadInput: the plant is not one.
    """
    if pose is None:
        raise BadInput("kind", "act on a body in water", "used with another plant", hint="Use kind: sinusoid")
    return pose


def with_water(load: Load, pose: Pose | None, velocity: Vector3, acceleration: Vector3) -> Load:
    """Load with an added velocity (m/s) and acceleration (m/s^2) of the water, world axes."""
    body_of(pose)
    before = load.water or Water(jnp.zeros(3), jnp.zeros(3))
    return load._replace(water=Water(before.velocity + velocity, before.acceleration + acceleration))


def with_surface(load: Load, pose: Pose | None, depth: Scalar, elevation: Scalar) -> Load:
    """Load under a surface of the water; elevations add, and the depth is that which was stated first.

    Args:
        load: so far.
        pose: of the body.
        depth: of the world's origin below the surface at rest, m.
        elevation: of the surface above the body, m.
    """
    body_of(pose)
    before = load.surface or FreeSurface(depth, jnp.zeros(()))
    return load._replace(surface=FreeSurface(before.depth, before.elevation + elevation))


def with_force(load: Load, pose: Pose | None, force: Vector3, point: Vector3) -> Load:
    """Load with an added force (N, world axes) at a point of the body (m, body axes)."""
    pull = matvec(body_of(pose).rotation.T, force)
    return load._replace(wrench=load.wrench - jnp.concatenate([pull, cross(point, pull)]))


def with_scaling(load: Load, pose: Pose | None, scaling: ModelScaling) -> Load:
    """Load with the factors of the body multiplied by these."""
    body_of(pose)
    product = (
        scaling if load.scaling is None else ModelScaling(*(a * b for a, b in zip(load.scaling, scaling, strict=True)))
    )
    return load._replace(scaling=product)


def with_payload(load: Load, pose: Pose | None, payload: Payload) -> Load:
    """Load with an added payload of the body."""
    body_of(pose)
    return load._replace(payloads=(*load.payloads, payload))
