"""Keeping adapted parameters inside a box, without losing what a Lyapunov function promises."""

import jax.numpy as jnp
from jaxtyping import Array, Float


def projected_rate(
    value: Float[Array, "..."], rate: Float[Array, "..."], bound: Float[Array, "..."]
) -> Float[Array, "..."]:
    """`rate`, but zero where `value` stands at +-bound and would leave.

    What is left out never points towards a point inside the box, so the distance to any such point falls at
    least as fast as without.
    """
    leaving = (jnp.abs(value) >= bound) & (value * rate > 0)
    return jnp.where(leaving, 0.0, rate)
