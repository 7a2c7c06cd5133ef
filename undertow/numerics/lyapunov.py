"""Lyapunov matrix of the tracking-error dynamics, Eq. (21)."""

import jax.numpy as jnp
from jaxtyping import Array, Float


def companion_lyapunov(feedback: Float[Array, "*n 2"], weight: Float[Array, "*n 2 2"]) -> Float[Array, "*n 2 2"]:
    """P of A^T P + P A + Q = 0, A = [[0, 1], [-k1, -k2]], Eq. (21), in closed form for every axis.

    Args:
        feedback: gains (k1, k2) of each axis, 1/s^2 and 1/s.
        weight: symmetric Q of each axis.
    """
    k1, k2 = feedback[..., 0], feedback[..., 1]
    p12 = weight[..., 0, 0] / (2 * k1)
    p22 = (weight[..., 1, 1] + 2 * p12) / (2 * k2)
    p11 = k1 * p22 + k2 * p12 - weight[..., 0, 1]
    return jnp.stack([jnp.stack([p11, p12], -1), jnp.stack([p12, p22], -1)], -2)
