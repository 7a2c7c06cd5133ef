"""A body in water that moves: its velocity relative to the water, and gravity in water that accelerates.

Where the water is uniform over the body, the world seen from the moving water is still water: Fossen (2021), ch. 10.3.
If the water accelerates as well, everything in it, the body's own mass and the water it displaces, feels the
acceleration as gravity.
"""

from typing import NamedTuple

import jax.numpy as jnp
from jaxtyping import Array, Float

from undertow.core.contracts import Water
from undertow.numerics.linear_algebra import matvec
from undertow.numerics.rotations import cross

Vector3 = Float[Array, "3"]
Vector6 = Float[Array, "6"]


class SeenFromWater(NamedTuple):
    """What the equation of motion is evaluated with, body axes."""

    nu: Vector6  # velocity through the water, m/s, rad/s
    down: Vector3  # direction of what is felt as gravity, in units of gravity
    rate: Vector6 | Float[Array, ""]  # nu_dot less that of the velocity through the water, m/s^2


def seen_from_water(
    water: Water | None, rotation: Float[Array, "3 3"], nu: Vector6, gravity: Float[Array, ""]
) -> SeenFromWater:
    """The body as seen from the water around it.

    Args:
        water: how the water moves, world axes; None for water at rest.
        rotation: body -> world.
        nu: body velocity over ground, m/s and rad/s.
        gravity: m/s^2.
    """
    if water is None:
        return SeenFromWater(nu, rotation[2], jnp.zeros(()))
    flow = matvec(rotation.T, water.velocity)
    acceleration = matvec(rotation.T, water.acceleration)
    rest = jnp.zeros(3)
    return SeenFromWater(
        nu=nu - jnp.concatenate([flow, rest]),
        down=rotation[2] - acceleration / gravity,
        rate=jnp.concatenate([acceleration - cross(nu[3:], flow), rest]),
    )
