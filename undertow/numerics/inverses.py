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


def partial_inverse(gain: Gain, scale: Float[Array, " n"], rank: int) -> Inverse:
    """Smallest inverse that serves as many rows of G as its rank allows exactly, and asks nothing for the others.

    G+ spreads what cannot be had over all rows instead: a vehicle that cannot pitch would surge because pitch is asked
    for. Given up are the rows that the lost directions mostly consist of (Cholesky of their projector, pivoted).

    Args:
        gain: G (n x m).
        scale: what counts as much in each row, m/s^2 and rad/s^2.
        rank: of G; n for G+ itself.
    """
    inverse = pseudo_inverse(gain)
    if rank == gain.shape[0]:
        return inverse
    lost = jnp.eye(gain.shape[0]) - gain @ inverse
    left, rows = lost * scale[:, None] * scale, []
    for _ in range(gain.shape[0] - rank):
        row = jnp.argmax(jnp.diagonal(left))
        left = left - jnp.outer(left[:, row], left[row]) / left[row, row]
        rows.append(row)
    rows = jnp.stack(rows)
    given_up = jnp.linalg.solve(lost[rows][:, rows], lost[rows])
    return inverse - inverse[:, rows] @ given_up


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
