"""Inverses of a gain matrix G (n x m), square or not: Eqs. (22)-(27) and Definition 2.

The paper splits cases by the number of inputs m; what matters is the rank. For m < n the product G G+ is an
orthogonal projector of rank < n, so [G G+]^-1 in Eq. (24) never exists; what remains uncontrolled is the
residual sigma of Eq. (28). See docs/known-limits.md.
"""

import jax.numpy as jnp
from jaxtyping import Array, Float

Gain = Float[Array, "n m"]
Inverse = Float[Array, "m n"]
Square = Float[Array, "n n"]


def printed_inverse(gain: Gain) -> Inverse:
    """G+ exactly as printed in Eq. (22): left inverse (m < n), inverse (m = n), right inverse (m > n).

    Needs full column rank (m < n) or full row rank (m >= n).
    """
    n, m = gain.shape
    if m < n:
        return jnp.linalg.solve(gain.T @ gain, gain.T)
    if m == n:
        return jnp.linalg.inv(gain)
    return gain.T @ jnp.linalg.inv(gain @ gain.T)


def pseudo_inverse(gain: Gain) -> Inverse:
    """Moore-Penrose G+ of any rank; equals Eq. (22) wherever that exists."""
    return jnp.linalg.pinv(gain)


def regularised_inverse(square: Square, delta: Float[Array, ""]) -> Square:
    """H^r = H^T (delta I + H H^T)^-1, Definition 2."""
    identity = jnp.eye(square.shape[0])
    return square.T @ jnp.linalg.inv(delta * identity + square @ square.T)


def regularised_sharp(gain: Gain, delta: Float[Array, ""]) -> Inverse:
    """reg G# of Eq. (27), in its three cases.

    Loses the share delta / (delta + sigma^4) of the demand along a singular value sigma of G (m > n); for
    m < n and full column rank it is nearly G+ / (1 + delta).
    """
    n, m = gain.shape
    if m < n:
        left = regularised_inverse(gain.T @ gain, delta) @ gain.T
        return left @ regularised_inverse(gain @ left, delta)
    if m == n:
        return regularised_inverse(gain, delta)
    return gain.T @ regularised_inverse(gain @ gain.T, delta)
