"""Small dense products, systems and inverses: gain matrices G (n x m), square or not, Eqs. (21)-(27), Definition 2.

The paper distinguishes cases by the number of inputs m, but the rank decides. For m < n the product G G+ is an
orthogonal projector of rank < n, so [G G+]^-1 in Eq. (24) never exists; the uncontrolled part is the residual
sigma of Eq. (28). See docs/explanation/known-limits.md.
"""

import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from undertow.core.kept_programs import kept_program, kept_values
from undertow.core.numerics.number import Number


def matvec(matrix: Float[Array, "m n"], vector: Float[Array, " n"]) -> Float[Array, " m"]:
    """Product of a small matrix and a vector.

    A multiplication and a sum instead of a `dot`: XLA turns every `dot` into a call of its own, which for a 6 x 8
    matrix costs more than the arithmetic. XLA fuses this form with the elementwise code around it, so that one
    closed-loop step becomes one compiled function.
    """
    return (matrix * vector[None, :]).sum(-1)


def safe_sqrt(square: Float[Array, "..."]) -> Float[Array, "..."]:
    """Square root of what is positive, else 0, with slope 0 there, where that of `sqrt` is infinite."""
    return jnp.where(square > 0, jnp.sqrt(jnp.where(square > 0, square, 1.0)), 0.0)


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


@kept_values
@kept_program
def inverse(square: Square) -> Square:
    """Inverse of a square matrix."""
    return jnp.linalg.inv(square)


@kept_values
@kept_program
def pseudo_inverse(gain: Gain) -> Inverse:
    """Moore-Penrose inverse G+ for any rank; it equals Eq. (22) where that exists."""
    return jnp.linalg.pinv(gain)


def partial_inverse(gain: Gain, scale: Float[Array, " n"], rank: int) -> Inverse:
    """Minimum-norm inverse that satisfies as many rows of G exactly as its rank allows, and ignores the others.

    G+ spreads the unreachable part over all rows instead: a vehicle that cannot pitch would surge when pitch is
    commanded. The ignored rows are those with the largest share in the unreachable directions (pivoted Cholesky
    factorisation of their projector).

    Args:
        gain: G (n x m).
        scale: accelerations of equal weight, one per row, m/s^2 and rad/s^2.
        rank: of G; n for G+ itself.
    """
    inverse = pseudo_inverse(gain)
    if rank == gain.shape[0]:
        return inverse
    lost = jnp.eye(gain.shape[0]) - gain @ inverse
    remaining, rows = lost * scale[:, None] * scale[None, :], []
    for _ in range(gain.shape[0] - rank):
        row = jnp.argmax(jnp.diagonal(remaining))
        remaining = remaining - jnp.outer(remaining[:, row], remaining[row]) / remaining[row, row]
        rows.append(row)
    rows = jnp.stack(rows)
    given_up = jnp.linalg.solve(lost[rows][:, rows], lost[rows])
    return inverse - inverse[:, rows] @ given_up


def regularised_inverse(square: Square, delta: Number) -> Square:
    """H^r = H^T (delta I + H H^T)^-1, Definition 2."""
    identity = jnp.eye(square.shape[0])
    return square.T @ jnp.linalg.inv(delta * identity + square @ square.T)


def regularised_sharp(gain: Gain, delta: Number) -> Inverse:
    """reg G# of Eq. (27), in its three cases.

    It loses the share delta / (delta + sigma^4) of the demand along a singular value sigma of G (m > n); for
    m < n and full column rank it is nearly G+ / (1 + delta).
    """
    n, m = gain.shape
    if m < n:
        left = regularised_inverse(gain.T @ gain, delta) @ gain.T
        return left @ regularised_inverse(gain @ left, delta)
    if m == n:
        return regularised_inverse(gain, delta)
    return gain.T @ regularised_inverse(gain @ gain.T, delta)


def companion_lyapunov(feedback: Float[Array, "*#n 2"], weight: Float[Array, "*#n 2 2"]) -> Float[Array, "*#n 2 2"]:
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


Symmetric = Float[Array, "n n"]


def solve_symmetric(matrix: Symmetric, right: Float[Array, " n"]) -> Float[Array, " n"]:
    """Solution of a symmetric positive definite system."""
    return _eliminated(matrix, right[:, None])[:, 0]


def inverse_symmetric(matrix: Symmetric) -> Symmetric:
    """Inverse of a symmetric positive definite matrix, without pivoting."""
    return _eliminated(matrix, jnp.eye(matrix.shape[0]))


def _eliminated(matrix: Float[Array, "n n"], right: Float[Array, "n k"]) -> Float[Array, "n k"]:
    """Solutions of symmetric positive definite systems by Gauss-Jordan elimination."""

    def eliminate(k, rows):
        pivot = rows[k] / rows[k, k]
        column = rows[:, k].at[k].set(0.0)
        return (rows - column[:, None] * pivot[None, :]).at[k].set(pivot)

    n = matrix.shape[0]
    return jax.lax.fori_loop(0, n, eliminate, jnp.concatenate([matrix, right], axis=1))[:, n:]
