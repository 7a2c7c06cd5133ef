"""Which thrusters explain what the residual shows as a fault can: one of them, two at once, or one without effect."""

from typing import NamedTuple

import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from undertow.control.supervision.fault_onset import OnsetState, Weighed, Wide

PerActuator = Float[Array, " m"]

# Share of the nominal force that is missing of each thruster of a pair, both off: measured 0.4 to 1 from 0.15 to 0.3 s
# after the onset, because of the low-passes and the motor.
_OFF_LEAST, _OFF_MOST = 0.35, 1.15
# Part of its own square by which the best hypothesis is at least ahead of the second best.
_AHEAD = 0.3
# Factor with which what is left unexplained counts where it is more than noise.
_EXCESS = 2.0
# Factors by which a pair must explain more, and be further ahead, than a single thruster, and the part it explains.
_PAIR_SQUARE, _PAIR_MARGIN, _PAIR_EXPLAINED = 5.0, 4.0, 0.8
# Determinant of two directions, relative to their squares, from which on they are distinguished.
_APART = 1e-3


class FaultThresholds(NamedTuple):
    """What a fault must satisfy."""

    square: Float[Array, ""]  # least explained square
    margin: Float[Array, ""]  # least explained square beyond that of the second best
    force: PerActuator  # smallest missing force, N
    # Share of the nominal force that is missing: 1 where a thruster is off, 2 where it is reversed; estimated with
    # noise and with errors of the thruster model. Below the least one a loss is not worth an alarm.
    least_share: float = 0.25
    most_share: float = 3.3
    explained: float = 0.6  # least part of what is more than noise that one thruster explains


def one_thruster(
    state: OnsetState, missing_now: Float[Array, "k m"], used: PerActuator, bounds: FaultThresholds
) -> tuple[PerActuator, Float[Array, ""]]:
    """1 for the thruster that explains the innovations since some onset as a fault can, and what it explains.

    With s what a thruster that is off adds to the innovations e, and sums since the onset, a = sum s.Pe / sum s.Ps is
    the share that is missing and J = a sum s.Pe the square that it explains: a generalised likelihood ratio (Willsky
    and Jones, 1976). Where the rest, sum e.Pe - J, is more than noise, the noise is greater than the covariance says,
    and J is divided by that factor.

    Args:
        state: of the onsets.
        missing_now: force that a thruster that stopped at each onset is missing by now, N.
        used: 1 for a thruster that is in use, else 0.
        bounds: what a fault must satisfy.
    """
    missing = state.along / jnp.where(state.size > 0, state.size, 1.0)
    possible = (missing > 0) & (missing < bounds.most_share + 0.2) & (used > 0)[None]
    explained = jnp.where(possible, missing * state.along, 0.0)
    explained_by = explained.max(0)
    best = explained_by.max()
    is_best = (explained >= best) & (best > 0)
    of_best = lambda value: jnp.where(is_best, value, 0.0).max()
    second = jnp.where(is_best.any(0), 0.0, explained_by).max()
    share, force = of_best(missing), of_best(missing * jnp.abs(missing_now) / bounds.force[None])
    unexplained = of_best(state.total[:, None]) - best
    axes = state.covariance.shape[0]
    freedom = axes * of_best(jnp.arange(1.0, len(state.total) + 1)[:, None]) - 1
    sufficient = best > bounds.explained * (unexplained + best - freedom)
    noise = _noise(unexplained, freedom)
    best, second = best / noise, second / noise
    clear = sufficient & (best > bounds.square) & (best - second > jnp.maximum(bounds.margin, _AHEAD * best))
    believable = (share > bounds.least_share) & (share < bounds.most_share) & (force > 1)
    return jnp.where(is_best.any(0) & clear & believable, 1.0, 0.0), best


def two_thrusters(wide: Wide, forces: PerActuator, used: PerActuator, bounds: FaultThresholds) -> PerActuator:
    """1 for both thrusters of the pair that explains the wide difference where both are off, else 0.

    The forces of a pair are the solution of its normal equations, two by two. They are computed only where one thruster
    leaves a square unexplained that is above the bound.

    Args:
        wide: the wide difference.
        forces: nominal ones, N.
        used: 1 for a thruster that is in use, else 0.
        bounds: what a fault must satisfy.
    """
    products, size, along, total = wide.weighed
    opposed = (along * forces < 0) & (used > 0)
    single = jnp.where(opposed, along * along / size, 0.0).max()

    def solved():
        squares = size[:, None] * size[None, :]
        determinant = squares - products * products
        separable = determinant > _APART * squares  # never so for a thruster and itself
        # Force of thruster i (row) in the pair of i and j (column).
        force = size[None, :] * along[:, None] - products * along[None, :]
        force = force / jnp.where(separable, determinant, 1.0)
        explained = force * along[:, None]
        explained = explained + explained.T
        nominal, missing = jnp.abs(forces)[:, None], -force * jnp.sign(forces)[:, None]
        stopped = (missing > _OFF_LEAST * nominal) & (missing < _OFF_MOST * nominal)
        fits = stopped & (jnp.abs(force) > bounds.force[:, None]) & (used > 0)[:, None]
        once = jnp.triu(jnp.ones_like(explained), 1) > 0  # rounding may differ between (i, j) and (j, i)
        explained = jnp.where(separable & fits & fits.T & once, explained, 0.0)
        best = explained.max()
        is_best = explained >= best
        second = jnp.where(is_best, 0.0, explained).max()
        clear = (
            (best > _PAIR_SQUARE * bounds.square)
            & (best > _PAIR_EXPLAINED * total)
            & (best - single > bounds.square)
            & (best - second > jnp.maximum(_PAIR_MARGIN * bounds.margin, total - best))
        )
        pair = jnp.where(is_best & clear, 1.0, 0.0)
        return jnp.maximum(pair.max(0), pair.max(1))

    return jax.lax.cond(total - single > bounds.square, solved, lambda: jnp.zeros_like(forces))


def missing_effect(weighed: Weighed, changes: PerActuator) -> Float[Array, "m m"]:
    """Log-likelihood ratio of "off" to "healthy" by one vector: of each thruster (diagonal) and of each pair.

    Args:
        weighed: the vector and directions.
        changes: what the vector would contain of the nominal forces if they had no effect, N, with its sign reversed.
    """
    single = -2 * changes * weighed.along - changes * changes * weighed.size
    interaction = 2 * changes[:, None] * changes[None, :] * weighed.products
    pair = single[:, None] + single[None, :] - interaction
    diagonal = jnp.eye(len(changes))
    return jnp.where(diagonal > 0, single[:, None] * diagonal, pair)


def _noise(unexplained: Float[Array, ""], freedom) -> Float[Array, ""]:
    """Factor by which the noise is greater than the covariance says, if it is."""
    return jnp.maximum(1.0, _EXCESS * unexplained / freedom)
