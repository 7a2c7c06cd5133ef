"""Small symmetric positive definite systems by Gauss-Jordan elimination: what lanes can do."""

import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

Symmetric = Float[Array, "n n"]


def solve_symmetric(matrix: Symmetric, right: Float[Array, " n"]) -> Float[Array, " n"]:
    """Solution of a symmetric positive definite system."""
    return _eliminated(matrix, right[:, None])[:, 0]


def inverse_symmetric(matrix: Symmetric) -> Symmetric:
    """Inverse of a symmetric positive definite matrix; it needs no pivots."""
    return _eliminated(matrix, jnp.eye(matrix.shape[0]))


def _eliminated(matrix: Float[Array, "n n"], right: Float[Array, "n k"]) -> Float[Array, "n k"]:
    """Solutions of symmetric positive definite systems by Gauss-Jordan elimination."""

    def eliminate(k, rows):
        pivot = rows[k] / rows[k, k]
        column = rows[:, k].at[k].set(0.0)
        return (rows - column[:, None] * pivot).at[k].set(pivot)

    n = matrix.shape[0]
    return jax.lax.fori_loop(0, n, eliminate, jnp.concatenate([matrix, right], axis=1))[:, n:]
