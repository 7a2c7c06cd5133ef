"""Strictly convex quadratic programme with bounds, by an exact active-set method.

The thruster allocation poses one (controllers/thruster_allocation.py). Small enough for a control loop (about ten
variables): every step solves one symmetric system by elimination without pivots, written as rank-one updates, so that
nothing leaves the compiled loop.
"""

from typing import NamedTuple

import jax
import jax.numpy as jnp
from jaxtyping import Array, Bool, Float, Int

from undertow.numerics.linear_algebra import inverse_symmetric, matvec, solve_symmetric

Vector = Float[Array, " n"]

# Most steps per variable; the result is feasible even then, but not optimal. Random problems take 1 to 2.
_STEPS = 4
_SLIGHT = 1e-12  # of the gradient's norm: a multiplier of the wrong sign below this is rounding


class _Search(NamedTuple):
    x: Vector
    free: Bool[Array, " n"]
    step: Int[Array, ""]
    done: Bool[Array, ""]


@jax.custom_jvp
def box_minimum(matrix: Float[Array, "n n"], linear: Vector, low: Vector, high: Vector) -> Vector:
    """x between low and high with the smallest x^T H x / 2 - c^T x. Nocedal and Wright (2006), section 16.5.

    Differentiable: variables at a bound follow the bound, the others the linear system that they solve.

    Args:
        matrix: H, symmetric, positive definite.
        linear: c.
        low, high: bounds, low <= high.
    """
    start = solve_symmetric(matrix, linear)
    x = jnp.clip(start, low, high)
    nothing = jnp.zeros((), dtype=int)
    first = _Search(x, (start > low) & (start < high), nothing, (x == start).all())
    most = _STEPS * linear.shape[0]
    step = lambda search: _step(matrix, linear, low, high, search)
    return jax.lax.while_loop(lambda search: ~search.done & (search.step < most), step, first).x


@box_minimum.defjvp
def _derivative(primals, tangents):
    matrix, linear, low, high = primals
    matrix_dot, linear_dot, low_dot, high_dot = tangents
    x = box_minimum(matrix, linear, low, high)
    free = (x > low) & (x < high)
    held_dot = jnp.where(free, 0.0, jnp.where(x >= high, high_dot, low_dot))
    right = linear_dot - matvec(matrix_dot, x) - matvec(matrix, held_dot)
    inverse = inverse_symmetric(_among(free, matrix))
    return x, jnp.where(free, matvec(inverse, jnp.where(free, right, 0.0)), held_dot)


def _among(free: Bool[Array, " n"], matrix: Float[Array, "n n"]) -> Float[Array, "n n"]:
    """Matrix of the free variables; the identity for the others."""
    return jnp.where(free[:, None] & free[None, :], matrix, jnp.eye(matrix.shape[0]))


def _step(matrix, linear, low, high, search: _Search) -> _Search:
    """Step to the minimum over the free variables or to the first bound; at a minimum, release the worst bound."""
    x, free, step, _ = search
    held = jnp.where(free, 0.0, x)
    target = jnp.where(
        free, solve_symmetric(_among(free, matrix), jnp.where(free, linear - matvec(matrix, held), 0.0)), x
    )
    room = jnp.where(target < x, low - x, high - x) / jnp.where(target == x, 1.0, target - x)
    room = jnp.where(target == x, jnp.inf, room)
    reached = room.min() >= 1.0
    hit = (jnp.arange(x.shape[0]) == room.argmin()) & ~reached
    x = jnp.where(reached, target, jnp.where(hit, jnp.where(target < x, low, high), x + room.min() * (target - x)))
    x = jnp.clip(x, low, high)
    gradient = matvec(matrix, x) - linear
    pull = jnp.where(x >= high, gradient, jnp.where(x <= low, -gradient, 0.0))
    pull = jnp.where(free | (low >= high), 0.0, pull)  # multiplier of each active bound
    worst = (jnp.arange(x.shape[0]) == pull.argmax()) & (pull.max() > _SLIGHT * jnp.abs(linear).max())
    return _Search(x, (free & ~hit) | (worst & reached), step + 1, reached & ~worst.any())
