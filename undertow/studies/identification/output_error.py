"""The estimate: output error over segments whose begin is free, by Levenberg and Marquardt's method.

Unknown are some tens of numbers of all segments and twelve of each one. The twelve are eliminated from the normal
equations segment by segment, so that an iteration costs what the derivatives cost. General solvers of least squares
would store a matrix of all residuals by all unknowns, which is a gigabyte for ten minutes of a dive.
"""

from collections.abc import Callable
from typing import NamedTuple

import jax.numpy as jnp
import numpy as np

from undertow.studies.identification.dive import SENSOR_OF_RESIDUAL
from undertow.studies.identification.model import (
    IdentificationModel,
    NormalEquations,
    all_residuals,
    normal_equations,
    scores,
)
from undertow.studies.identification.outliers import NEIGHBOURS, from_neighbours
from undertow.studies.identification.segments import Segments

# Standard deviations from the median of the neighbours, from which on a sample counts as an outlier: what the model
# lacks moves all of them.
_OUTLIER = 4.0
_LARGE = 3.0  # standard deviations of the residual, below which no sample is an outlier
_SURPRISE = 5.0  # standard deviations, beyond which a residual says no more
_SMALLEST_NOISE = 1e-4  # m, rad, m/s, rad/s
_FIRST_NOISE = np.repeat([0.05, 0.03, 0.05, 0.05, 0.05], (3, 3, 3, 3, 1))
_FASTEST = 2.0  # factor by which the noise may change in an iteration
_ITERATIONS = 60
_REWEIGHTED = 20  # iterations after which noise and outliers stay: where the model lacks something, they may alternate
_TRIES = 10  # dampings of a step
_GOOD, _POOR = 0.75, 0.25  # shares of the expected decrease above and below which the damping changes
_CONVERGED = 0.05  # decrease of the cost; 0.5 is one standard deviation of a parameter
_RELATIVE = 5e-5  # the same as a share of the cost, where residuals are not white
_NOISE_CONVERGED = 0.02  # largest relative change of a noise


class Solution(NamedTuple):
    """Where the solver came to rest; everything else of a `Fit` follows.

    Attributes:
        z: unknowns.
        starts: of the segments, (S, 12).
        noise: standard deviation of each kind of residual, (13,); infinite without samples.
        shares: by which residuals count, less than 1 for outliers, (S, length, 13).
        iterations: of the solver.
        converged: whether it came to rest.
    """

    z: np.ndarray
    starts: np.ndarray
    noise: np.ndarray
    shares: np.ndarray
    iterations: int
    converged: bool


class Fit(NamedTuple):
    """An estimate: a solution, and what follows from it.

    Attributes:
        z, starts, noise, shares, iterations, converged: of the solution.
        weights: of the residuals, (S, length, 13).
        information: second derivative of half the sum of squares by the unknowns, the begins eliminated, prior
            included, (P, P).
        reduction: bb^-1 ab' of each segment.
        residuals: (S, length, 13).
        cost: half the sum of squares, priors included.
    """

    z: np.ndarray
    starts: np.ndarray
    noise: np.ndarray
    shares: np.ndarray
    iterations: int
    converged: bool
    weights: np.ndarray
    information: np.ndarray
    reduction: np.ndarray
    residuals: np.ndarray
    cost: float


def fit(
    model: IdentificationModel,
    segments: Segments,
    step: float,
    z: np.ndarray,
    least: np.ndarray,
    watch: Callable[[int, float], None] = lambda iteration, cost: None,
    noise: np.ndarray | None = None,
) -> Fit:
    """The unknowns that make predictions and measurements agree best, given what was known beforehand.

    Args:
        model: see there.
        segments: of the dives.
        step: s.
        z: where to begin.
        least: smallest numbers.
        watch: called with the iteration and the cost.
        noise: standard deviations of the residuals, where they and `z` are near those of the estimate.
    """
    starts = np.zeros((len(segments.dive), 12))
    counts = segments.counts[:, :, SENSOR_OF_RESIDUAL]
    z = np.maximum(z, least)
    residuals = _residuals(model, segments, step, z, starts)
    noise = _first_noise(counts) if noise is None else noise
    shares = _shares(residuals, counts)
    damping, converged, iteration = 1e-3, False, 0
    for iteration in range(1, _ITERATIONS + 1):
        weights = shares * counts / noise**2
        cost = _cost(residuals, weights, z, starts)
        watch(iteration, cost)
        parts = _evaluated(model, segments, weights, step, z, starts)
        trial = _improved(model, segments, parts, weights, step, z, starts, least, damping, cost)
        small = trial is None
        if trial is not None:
            small = cost - trial.cost < max(_CONVERGED, _RELATIVE * cost)
            z, starts, residuals, damping = trial.z, trial.starts, trial.residuals, trial.damping
        steady = True
        if iteration <= _REWEIGHTED:
            shares = _shares(residuals, counts)
            new_noise = np.clip(_noise(residuals, counts, shares), noise / _FASTEST, noise * _FASTEST)
            finite = np.isfinite(new_noise)
            steady = np.abs(new_noise[finite] / noise[finite] - 1).max() < _NOISE_CONVERGED
            noise = new_noise
        if steady and small:
            converged = True
            break
    return completed(model, segments, step, Solution(z, starts, noise, shares, iteration, converged))


def completed(model: IdentificationModel, segments: Segments, step: float, solution: Solution) -> Fit:
    """The estimate that belongs to a solution.

    Args:
        model, segments, step: with which it was found.
        solution: see there.
    """
    z, starts = solution.z, solution.starts
    weights = solution.shares * segments.counts[:, :, SENSOR_OF_RESIDUAL] / solution.noise**2
    residuals = _residuals(model, segments, step, z, starts)
    information, _, reduction = _reduced(_evaluated(model, segments, weights, step, z, starts), z, starts, 0.0)
    return Fit(*solution, weights, information, reduction, residuals, _cost(residuals, weights, z, starts))


def first_errors(model: IdentificationModel, segments: Segments, step: float, z: np.ndarray) -> float:
    """Sum of squared residuals over usual noise, each at most `_SURPRISE` squared, from the guessed begins.

    Args:
        model, segments, step, z: as above.
    """
    counts = segments.counts[:, :, SENSOR_OF_RESIDUAL]
    residuals = _residuals(model, segments, step, z, np.zeros((len(segments.dive), 12)))
    squares = np.where(counts > 0, counts * residuals**2 / _first_noise(counts) ** 2, 0.0)
    return float(np.minimum(np.nan_to_num(squares, nan=np.inf, posinf=np.inf), _SURPRISE**2).sum())


class _Trial(NamedTuple):
    z: np.ndarray
    starts: np.ndarray
    residuals: np.ndarray
    cost: float
    damping: float  # for the next step


def _improved(model, segments, parts, weights, step, z, starts, least, damping: float, cost: float) -> _Trial | None:
    """The first of some steps, ever shorter, that lowers the cost; None where none does."""
    for _ in range(_TRIES):
        new_z, new_starts = _step(parts, z, starts, damping, least)
        residuals = _residuals(model, segments, step, new_z, new_starts)
        new_cost = _cost(residuals, weights, new_z, new_starts)
        if np.isfinite(new_cost) and new_cost <= cost:
            share = (cost - new_cost) / max(_expected(parts, z, starts, new_z, new_starts), 1e-300)
            following = damping / 10 if share > _GOOD else damping * (3 if share < _POOR else 1)
            return _Trial(new_z, new_starts, residuals, new_cost, max(following, 1e-9))
        damping *= 10
    return None


def _expected(parts: NormalEquations, z, starts, new_z, new_starts) -> float:
    """Decrease of the cost if residuals were linear."""
    dz, ds = new_z - z, new_starts - starts
    linear = dz @ (parts.a.sum(axis=0) + z) + (ds * (parts.b + starts)).sum()
    square = dz @ (parts.aa.sum(axis=0) + np.eye(len(z))) @ dz + (ds * ds).sum()
    square += np.einsum("sq,sqr,sr->", ds, parts.bb, ds) + 2 * np.einsum("p,spq,sq->", dz, parts.ab, ds)
    return float(-linear - 0.5 * square)


def _residuals(model, segments, step, z, starts) -> np.ndarray:
    return np.asarray(all_residuals(model, jnp.asarray(z), jnp.asarray(starts), segments, step))


def _cost(residuals: np.ndarray, weights: np.ndarray, z: np.ndarray, starts: np.ndarray) -> float:
    """Half the sum of squares, with what was known beforehand."""
    with np.errstate(over="ignore"):  # of a step that went much too far, and is not taken
        squares = np.where(weights > 0, weights * residuals**2, 0.0).sum()
    return float(0.5 * (squares + (z**2).sum() + (starts**2).sum()))


def _evaluated(model, segments, weights, step, z, starts) -> NormalEquations:
    parts = normal_equations(model, jnp.asarray(z), jnp.asarray(starts), segments, jnp.asarray(weights), step)
    return NormalEquations(*(np.asarray(part) for part in parts))


def _reduced(parts: NormalEquations, z: np.ndarray, starts: np.ndarray, damping: float):
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


def _step(parts: NormalEquations, z: np.ndarray, starts: np.ndarray, damping: float, least: np.ndarray):
    """The next unknowns and begins."""
    information, gradient, _ = _reduced(parts, z, starts, damping)
    information = information + damping * np.diag(np.diagonal(information))
    new_z = np.maximum(z + _change(information, gradient, z <= least), least)
    right = parts.b + starts + np.einsum("spq,p->sq", parts.ab, new_z - z)
    return new_z, starts - np.linalg.solve(_damped(parts, damping), right[..., None])[..., 0]


def _change(information: np.ndarray, gradient: np.ndarray, at_least: np.ndarray) -> np.ndarray:
    """Newton's step; unknowns at their smallest value that would become smaller stay there."""
    free = np.ones(len(gradient), dtype=bool)
    while True:
        change = np.zeros(len(gradient))
        change[free] = -np.linalg.solve(information[np.ix_(free, free)], gradient[free])
        blocked = free & at_least & (change < 0)
        if not blocked.any():
            return change
        free &= ~blocked


def _first_noise(counts: np.ndarray) -> np.ndarray:
    return np.where(counts.sum(axis=(0, 1)) > 0, _FIRST_NOISE, np.inf)


def _noise(residuals: np.ndarray, counts: np.ndarray, shares: np.ndarray) -> np.ndarray:
    """Standard deviation of a single sample for each kind of residual, outliers counted by their shares."""
    squares = np.where(counts > 0, shares * counts * residuals**2, 0.0).sum(axis=(0, 1))
    samples = np.where(counts > 0, shares, 0.0).sum(axis=(0, 1))
    mean = squares / np.maximum(samples, 1e-300)
    return np.where(samples > 0, np.maximum(np.sqrt(mean), _SMALLEST_NOISE), np.inf)


def _shares(residuals: np.ndarray, counts: np.ndarray) -> np.ndarray:
    """By which residuals count, Huber's: 1, and less for samples far from the median of their neighbours."""
    shares = np.ones(residuals.shape)
    for i in range(residuals.shape[2]):
        measured = counts[:, :, i] > 0
        of_one = residuals[:, :, i][measured] * np.sqrt(counts[:, :, i][measured])
        if len(of_one) >= NEIGHBOURS:
            apart = from_neighbours(of_one)
            scatter = max(_OUTLIER * _deviation(apart), _LARGE * _deviation(np.abs(of_one)))
            limit = max(scatter, _OUTLIER * _SMALLEST_NOISE)
            shares[:, :, i][measured] = np.where(apart > limit, limit / np.maximum(apart, limit), 1.0)
    return shares


def _deviation(sizes: np.ndarray) -> float:
    """Standard deviation of numbers of a normal distribution with these sizes, whatever a few of them are."""
    return 1.4826 * float(np.median(sizes))


def scores_of(model: IdentificationModel, segments: Segments, step: float, estimate: Fit) -> np.ndarray:
    """Gradient of each step, (S, length, P)."""
    return np.asarray(
        scores(
            model, jnp.asarray(estimate.z), jnp.asarray(estimate.starts), segments, jnp.asarray(estimate.weights),
            jnp.asarray(estimate.residuals), jnp.asarray(estimate.reduction), step,
        )
    )  # fmt: skip
