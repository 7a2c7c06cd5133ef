"""Steps of Levenberg and Marquardt's method for numbers of all segments and of each one.

Unknown are some tens of numbers of all segments and twelve of each one. The twelve are eliminated from the normal
equations segment by segment, so that an iteration costs what the derivatives cost. General solvers of least squares
would store a matrix of all residuals by all unknowns, which is a gigabyte for ten minutes of a dive.
"""

from typing import NamedTuple

import jax.numpy as jnp
import numpy as np

from undertow.studies.identification.model import NormalEquations, all_residuals, normal_equations

_TRIES = 10  # dampings of a step
_GOOD, _POOR = 0.75, 0.25  # shares of the expected decrease above and below which the damping changes


class Trial(NamedTuple):
    """Unknowns and begins after a step, and what the next one needs."""

    z: np.ndarray
    starts: np.ndarray
    residuals: np.ndarray
    cost: float
    damping: float  # for the next step


def improved(
    model, segments, parts, weights, step, z, starts, least, damping: float, cost: float, held: int | None = None
) -> Trial | None:
    """The first of some steps, ever shorter, that lowers the cost; None where none does. One unknown may be held."""
    for _ in range(_TRIES):
        new_z, new_starts = _step(parts, z, starts, damping, least, held)
        residuals = residuals_of(model, segments, step, new_z, new_starts)
        new_cost = cost_of(residuals, weights, new_z, new_starts)
        if np.isfinite(new_cost) and new_cost <= cost:
            share = (cost - new_cost) / max(_expected(parts, z, starts, new_z, new_starts), 1e-300)
            following = damping / 10 if share > _GOOD else damping * (3 if share < _POOR else 1)
            return Trial(new_z, new_starts, residuals, new_cost, max(following, 1e-9))
        damping *= 10
    return None


def _expected(parts: NormalEquations, z, starts, new_z, new_starts) -> float:
    """Decrease of the cost if residuals were linear."""
    dz, ds = new_z - z, new_starts - starts
    linear = dz @ (parts.a.sum(axis=0) + z) + (ds * (parts.b + starts)).sum()
    square = dz @ (parts.aa.sum(axis=0) + np.eye(len(z))) @ dz + (ds * ds).sum()
    square += np.einsum("sq,sqr,sr->", ds, parts.bb, ds) + 2 * np.einsum("p,spq,sq->", dz, parts.ab, ds)
    return float(-linear - 0.5 * square)


def residuals_of(model, segments, step, z, starts) -> np.ndarray:
    """Of all segments, (S, length, 13)."""
    return np.asarray(all_residuals(model, jnp.asarray(z), jnp.asarray(starts), segments, step))


def cost_of(residuals: np.ndarray, weights: np.ndarray, z: np.ndarray, starts: np.ndarray) -> float:
    """Half the sum of squares, with what was known beforehand."""
    with np.errstate(over="ignore"):  # of a step that went much too far, and is not taken
        squares = np.where(weights > 0, weights * residuals**2, 0.0).sum()
    return float(0.5 * (squares + (z**2).sum() + (starts**2).sum()))


def evaluated(model, segments, weights, step, z, starts) -> NormalEquations:
    """Normal equations of all segments."""
    parts = normal_equations(model, jnp.asarray(z), jnp.asarray(starts), segments, jnp.asarray(weights), step)
    return NormalEquations(*(np.asarray(part) for part in parts))


def reduced(parts: NormalEquations, z: np.ndarray, starts: np.ndarray, damping: float):
    """Information and gradient of the unknowns, with the begins of the segments eliminated, and the elimination."""
    bb = _damped(parts, damping)
    reduction = np.linalg.solve(bb, parts.ab.transpose(0, 2, 1))
    information = parts.aa.sum(axis=0) + np.eye(len(z)) - np.einsum("spq,sqr->pr", parts.ab, reduction)
    eliminated = np.linalg.solve(bb, (parts.b + starts)[..., None])[..., 0]
    gradient = parts.a.sum(axis=0) + z - np.einsum("spq,sq->p", parts.ab, eliminated)
    return information, gradient, reduction


def _damped(parts: NormalEquations, damping: float) -> np.ndarray:
    """B' B of each segment with what was known beforehand, damped, (S, 12, 12)."""
    bb = parts.bb + np.eye(12)
    return bb + damping * np.einsum("sii->si", bb)[:, :, None] * np.eye(12)


def _step(parts: NormalEquations, z: np.ndarray, starts: np.ndarray, damping: float, least: np.ndarray, held=None):
    """The next unknowns and begins."""
    information, gradient, _ = reduced(parts, z, starts, damping)
    information = information + damping * np.diag(np.diagonal(information))
    new_z = np.maximum(z + _change(information, gradient, z <= least, held), least)
    right = parts.b + starts + np.einsum("spq,p->sq", parts.ab, new_z - z)
    return new_z, starts - np.linalg.solve(_damped(parts, damping), right[..., None])[..., 0]


def _change(information: np.ndarray, gradient: np.ndarray, at_least: np.ndarray, held: int | None) -> np.ndarray:
    """Newton's step; unknowns at their smallest value that would become smaller stay there, and so does a held one."""
    free = np.arange(len(gradient)) != (-1 if held is None else held)
    while True:
        change = np.zeros(len(gradient))
        change[free] = -np.linalg.solve(information[np.ix_(free, free)], gradient[free])
        blocked = free & at_least & (change < 0)
        if not blocked.any():
            return change
        free &= ~blocked
