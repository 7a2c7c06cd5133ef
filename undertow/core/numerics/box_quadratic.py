"""Strictly convex quadratic programme with bounds, by an exact active-set method.

The thruster allocation poses one (controllers/thruster_allocation.py). Its matrix is a diagonal one and k products of
vectors, where k, the degrees of freedom, stays small however many thrusters there are. Every step therefore solves a
system of k equations (the Woodbury identity), so that its cost grows with the number of variables only linearly.
"""

from typing import NamedTuple

import jax
import jax.numpy as jnp
from jaxtyping import Array, Bool, Float, Int

from undertow.core.numerics.linear_algebra import inverse_symmetric, matvec, solve_symmetric

Vector = Float[Array, " n"]

# Most steps per variable; the result is feasible even then, but not optimal. Random problems take 1 to 2.
_STEPS = 4
_SLIGHT = 1e-12  # of the gradient's norm: a multiplier of the wrong sign below this is rounding


class _Programme(NamedTuple):
    """x^T H x / 2 - c^T x with H = D + F^T F.

    Attributes:
        diagonal: of D.
        factor: F.
        linear: c.
    """

    diagonal: Vector
    factor: Float[Array, "k n"]
    linear: Vector

    def curved(self, x: Vector) -> Vector:
        """H x."""
        return self.diagonal * x + matvec(self.factor.T, matvec(self.factor, x))

    def among(self, free: Bool[Array, " n"]) -> tuple[Vector, Float[Array, "k n"], Float[Array, "k k"]]:
        """S = D^(-1/2) of the free variables, F S and I + (F S) (F S)^T."""
        share = jnp.where(free, 1.0 / jnp.sqrt(self.diagonal), 0.0)
        half = self.factor * share[None, :]
        # A sum of products rather than a `dot`, as in `matvec`; both triangles are the same numbers.
        return share, half, jnp.eye(len(half)) + (half[:, None, :] * half[None, :, :]).sum(-1)

    def minimum(self, free: Bool[Array, " n"], held: Vector) -> tuple[Vector, Float[Array, " k"]]:
        """Minimum over the free variables, and the residual r = -F x there.

        The free variables are D^-1 (c + F^T r), which subtracts no large numbers where D is small.

        Args:
            free: which variables.
            held: the others, and zeros for the free ones.
        """
        share, half, system = self.among(free)
        scaled = share * self.linear
        residual = solve_symmetric(system, -matvec(self.factor, held) - matvec(half, scaled))
        return jnp.where(free, share * (scaled + matvec(half.T, residual)), held), residual


class _Search(NamedTuple):
    x: Vector
    free: Bool[Array, " n"]
    step: Int[Array, ""]
    done: Bool[Array, ""]


@jax.custom_jvp
def box_minimum(diagonal: Vector, factor: Float[Array, "k n"], linear: Vector, low: Vector, high: Vector) -> Vector:
    """x between low and high with the smallest x^T H x / 2 - c^T x. Nocedal and Wright (2006), section 16.5.

    Differentiable: variables at a bound follow the bound, the others the linear system that they solve.

    Args:
        diagonal, factor: D and F of H = D + F^T F; D is positive.
        linear: c.
        low, high: bounds, low <= high.
    """
    programme = _Programme(diagonal, factor, linear)
    start, _ = programme.minimum(jnp.ones_like(linear, dtype=bool), jnp.zeros_like(linear))
    x = jnp.clip(start, low, high)
    zero = jnp.zeros((), dtype=int)
    first = _Search(x, (start > low) & (start < high), zero, (x == start).all())
    most = _STEPS * linear.shape[0]
    step = lambda search: _step(programme, low, high, search)
    return jax.lax.while_loop(lambda search: ~search.done & (search.step < most), step, first).x


@box_minimum.defjvp
def _derivative(primals, tangents):
    *problem, low, high = primals
    diagonal_dot, factor_dot, linear_dot, low_dot, high_dot = tangents
    programme, x = _Programme(*problem), box_minimum(*primals)
    free = (x > low) & (x < high)
    held_dot = jnp.where(free, 0.0, jnp.where(x >= high, high_dot, low_dot))
    factor = programme.factor
    turned = matvec(factor_dot.T, matvec(factor, x)) + matvec(factor.T, matvec(factor_dot, x))
    right = linear_dot - diagonal_dot * x - turned - programme.curved(held_dot)
    share, half, system = programme.among(free)
    scaled = share * right
    moved = share * (scaled - matvec(half.T, matvec(inverse_symmetric(system), matvec(half, scaled))))
    return x, jnp.where(free, moved, held_dot)


def _step(programme: _Programme, low: Vector, high: Vector, search: _Search) -> _Search:
    """Step to the minimum over the free variables or to the first bound; at a minimum, release the worst bound."""
    x, free, step, _ = search
    linear = programme.linear
    target, residual = programme.minimum(free, jnp.where(free, 0.0, x))
    room = jnp.where(target < x, low - x, high - x) / jnp.where(target == x, 1.0, target - x)
    room = jnp.where(target == x, jnp.inf, room)
    reached = room.min() >= 1.0
    hit = (jnp.arange(x.shape[0]) == room.argmin()) & ~reached
    x = jnp.where(reached, target, jnp.where(hit, jnp.where(target < x, low, high), x + room.min() * (target - x)))
    x = jnp.clip(x, low, high)
    # By the residual of the solution: -F x would bring the rounding of x, times H, and release a wrong bound.
    gradient = programme.diagonal * x - linear - matvec(programme.factor.T, residual)
    pull = jnp.where(x >= high, gradient, jnp.where(x <= low, -gradient, 0.0))
    pull = jnp.where(free | (low >= high), 0.0, pull)  # multiplier of each active bound
    worst = (jnp.arange(x.shape[0]) == pull.argmax()) & (pull.max() > _SLIGHT * jnp.abs(linear).max())
    return _Search(x, (free & ~hit) | (worst & reached), step + 1, reached & ~worst.any())
