"""Thrust lost to the water that flows into the propellers as the vehicle moves."""

import jax.numpy as jnp
from jaxtyping import Array, Float

from undertow.core.numerics.linear_algebra import safe_sqrt
from undertow.physics.thrusters.thruster import PerThruster


def advance_speed(thruster_matrix: Float[Array, "6 N"], nu: Float[Array, "6"]) -> Float[Array, " N"]:
    """Speed of each propeller through the water along its thrust, m/s: that at which its thrust does work, B^T nu."""
    return (thruster_matrix * nu[:, None]).sum(0)


def with_inflow(static_thrust: PerThruster, loss: Float[Array, ""], speed: PerThruster) -> PerThruster:
    """T = T_s - lambda |T_s|^(1/2) u, N: a thrust coefficient that falls linearly with the advance ratio.

    With K_T = K_0 - K_1 u / (n D) and T_s = rho D^4 K_0 n|n|, lambda is K_1 D (rho / K_0)^(1/2), in (N)^(1/2) s/m:
    Fossen (2021), ch. 9.1. The drag of a propeller that stands still, and propellers near the surface, are neglected.

    Args:
        static_thrust: T_s of the same command in water at rest, N.
        loss: lambda.
        speed: advance speed u, m/s; negative while the propeller is driven backwards through the water.
    """
    return static_thrust - loss * safe_sqrt(jnp.abs(static_thrust)) * speed


def static_thrust_for(thrust: PerThruster, loss: Float[Array, ""], speed: PerThruster) -> PerThruster:
    """T_s, N, that gives a thrust T with inflow: the inverse of `with_inflow`, in closed form.

    With q|q| = T_s and c = lambda u it is q|q| - c|q| = T. Thrusts between -c|c|/4 and 0 belong to several speeds of
    the propeller: the one that turns along the motion is taken, so that T_s is continuous through T = 0. It jumps by
    0.29 c^2 at -c|c|/4, where the thrust of that direction ends. No choice avoids a jump.
    """
    c = loss * speed
    ahead = 4 * thrust > -c * jnp.abs(c)
    sign = jnp.where(ahead, 1.0, -1.0)
    q = (c + sign * safe_sqrt(jnp.maximum(c * c + 4 * sign * thrust, 0.0))) / 2
    return q * jnp.abs(q)
