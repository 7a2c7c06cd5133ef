"""Which thrusters explain a residual as a fault can: one of them, two at once, or one that has no effect."""

from typing import NamedTuple

import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from undertow.numerics.linear_algebra import inverse_symmetric, matvec

PerActuator = Float[Array, " m"]

# Force beyond the nominal one times 2.5 (a reversed thruster differs by 2) that a fault may have, as a share of the
# largest force; and the largest force of a failed thruster, as a multiple of the nominal largest one.
_SLACK, _EXCESS, _MOST = 0.05, 2.5, 1.3
# Share of the nominal force that is missing where a thruster is off: measured 0.4 to 1 from 0.15 to 0.3 s after the
# onset, because of the low-passes and the motor. Above the second one, up to the third, it is reversed.
_OFF_LEAST, _OFF_MOST, _REVERSED = 0.35, 1.15, 1.9
# Part of what the best hypothesis leaves unexplained by which it is at least ahead of the second best.
_AHEAD = 0.5
# Factor by which a pair must explain more, and be further ahead, than a single thruster.
_PAIR = 4.0
# Determinant of two directions, relative to their squares, from which on they are distinguished.
_APART = 1e-3


class Weighed(NamedTuple):
    """Residual D and directions E_i of the thrusters, weighed by the inverse covariance P."""

    along: PerActuator  # E_i . P D
    products: Float[Array, "m m"]  # E_i . P E_j
    size: PerActuator  # E_i . P E_i
    total: Float[Array, ""]  # D . P D


class Bounds(NamedTuple):
    """What a residual must satisfy to be a fault."""

    off: Float[Array, ""]  # least explained square where the thruster is simply off
    other: Float[Array, ""]  # the same for another fault
    margin: Float[Array, ""]  # least explained square beyond that of the second best, and of one thruster for a pair
    explained: Float[Array, ""]  # least explained share
    least: Float[Array, ""]  # smallest force of a fault, as a share of the largest one


def weighed(effect: Float[Array, "n m"], covariance: Float[Array, "n n"], residual: Float[Array, " n"]) -> Weighed:
    """Residual and directions, weighed by the inverse of a covariance."""
    inverse = inverse_symmetric(covariance)
    pulled = matvec(inverse, residual)
    columns = effect.T
    stretched = (columns[:, None, :] * inverse[None, :, :]).sum(-1)
    products = (stretched[:, None, :] * columns[None, :, :]).sum(-1)
    own = (stretched * columns).sum(-1)
    return Weighed(matvec(columns, pulled), products, jnp.where(own > 0, own, 1.0), (residual * pulled).sum())


def one_thruster(
    seen: Weighed, forces: PerActuator, largest: PerActuator, used: PerActuator, bounds: Bounds
) -> tuple[PerActuator, Float[Array, ""]]:
    """1 for the thruster that explains the residual as a fault can, else 0; and the square that the best explains.

    Args:
        seen: residual and directions.
        forces: nominal ones, N.
        largest: largest ones, N.
        used: 1 for a thruster that is in use, else 0.
        bounds: what a fault must satisfy.
    """
    force, explained = seen.along / seen.size, seen.along * seen.along / seen.size
    nominal, missing = jnp.abs(forces), -force * jnp.sign(forces)
    possible = (missing > 0) & (missing < _EXCESS * nominal + _SLACK * largest) & (used > 0)
    explained = jnp.where(possible, explained, 0.0)
    best = explained.max()
    is_best = explained >= best
    second = jnp.where(is_best, 0.0, explained).max()
    needed = jnp.where(_is_off(missing, nominal), bounds.off, bounds.other)
    clear = (
        (best > needed)
        & (best > bounds.explained * seen.total)
        & (best - second > jnp.maximum(bounds.margin, _AHEAD * (seen.total - best)))
    )
    believable = (
        (jnp.abs(force) > bounds.least * largest)
        & (missing < _REVERSED * nominal)
        & (jnp.abs(forces + force) < _MOST * largest)
    )
    return jnp.where(is_best & clear & believable, 1.0, 0.0), best


def two_thrusters(
    seen: Weighed,
    forces: PerActuator,
    largest: PerActuator,
    used: PerActuator,
    bounds: Bounds,
    single: Float[Array, ""],
) -> PerActuator:
    """1 for both thrusters of the pair that explains the residual where both are off, else 0.

    The forces of a pair are the solution of its normal equations, two by two. They are computed only where one thruster
    leaves a square unexplained that is above the bound.

    Args:
        seen: residual and directions.
        forces: nominal ones, N.
        largest: largest ones, N.
        used: 1 for a thruster that is in use, else 0.
        bounds: what a fault must satisfy.
        single: square that the best single thruster explains.
    """

    def solved():
        along, size = seen.along, seen.size
        squares = size[:, None] * size[None, :]
        determinant = squares - seen.products * seen.products
        apart = determinant > _APART * squares  # never so for a thruster and itself
        # Force of thruster i (row) in the pair of i and j (column).
        force = size[None, :] * along[:, None] - seen.products * along[None, :]
        force = force / jnp.where(apart, determinant, 1.0)
        explained = force * along[:, None]
        explained = explained + explained.T
        nominal, missing = jnp.abs(forces)[:, None], -force * jnp.sign(forces)[:, None]
        fits = _is_off(missing, nominal) & (jnp.abs(force) > bounds.least * largest[:, None]) & (used > 0)[:, None]
        once = jnp.triu(jnp.ones_like(explained), 1) > 0  # rounding may differ between (i, j) and (j, i)
        explained = jnp.where(apart & fits & fits.T & once, explained, 0.0)
        best = explained.max()
        is_best = explained >= best
        second = jnp.where(is_best, 0.0, explained).max()
        clear = (
            (best > _PAIR * bounds.off)
            & (best > bounds.explained * seen.total)
            & (best - single > bounds.off)
            & (best - second > jnp.maximum(_PAIR * bounds.margin, seen.total - best))
        )
        found = jnp.where(is_best & clear, 1.0, 0.0)
        return jnp.maximum(found.max(0), found.max(1))

    return jax.lax.cond(seen.total - single > bounds.off, solved, lambda: jnp.zeros_like(forces))


def missing_effect(seen: Weighed, changes: PerActuator) -> Float[Array, "m m"]:
    """Log-likelihood ratio of "off" to "healthy" by one residual: of each thruster (diagonal) and of each pair.

    Args:
        seen: residual and directions.
        changes: what the residual would contain of the nominal forces if they had no effect, N, with its sign reversed.
    """
    single = -2 * changes * seen.along - changes * changes * seen.size
    together = 2 * changes[:, None] * changes[None, :] * seen.products
    pair = single[:, None] + single[None, :] - together
    diagonal = jnp.eye(len(changes))
    return jnp.where(diagonal > 0, single[:, None] * diagonal, pair)


def _is_off(missing, nominal):
    return (missing > _OFF_LEAST * nominal) & (missing < _OFF_MOST * nominal)
