"""An estimate: where a solver came to rest, and what follows from it."""

from typing import NamedTuple

import jax.numpy as jnp
import numpy as np

from undertow.studies.identification.dive import SENSOR_OF_RESIDUAL
from undertow.studies.identification.kalman_gains import Disturbance, with_filter
from undertow.studies.identification.least_squares import cost_of, evaluated, reduced, residuals_of
from undertow.studies.identification.model import IdentificationModel, scores
from undertow.studies.identification.segments import Segments


class Solution(NamedTuple):
    """Where the solver came to rest; everything else of a `Fit` follows.

    Attributes:
        z: unknowns.
        starts: of the segments, (S, 12).
        noise: standard deviation of each kind of residual, (13,); infinite without samples.
        shares: by which residuals count, less than 1 for outliers, (S, length, 13).
        iterations: of the solver.
        converged: whether it came to rest.
        disturbance: that pushes the vehicle, where a filter follows the motion; None for output error.
    """

    z: np.ndarray
    starts: np.ndarray
    noise: np.ndarray
    shares: np.ndarray
    iterations: int
    converged: bool
    disturbance: Disturbance | None = None


class Fit(NamedTuple):
    """An estimate: a solution, and what follows from it.

    Attributes:
        z, starts, noise, shares, iterations, converged, disturbance: of the solution.
        segments: from which it is, with the gains of the filter if there is one.
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
    disturbance: Disturbance | None
    segments: Segments
    weights: np.ndarray
    information: np.ndarray
    reduction: np.ndarray
    residuals: np.ndarray
    cost: float


def completed(model: IdentificationModel, segments: Segments, step: float, solution: Solution) -> Fit:
    """The estimate that belongs to a solution.

    Args:
        model, segments, step: with which it was found.
        solution: see there.
    """
    z, starts = solution.z, solution.starts
    weights = weights_of(segments, solution.noise, solution.shares)
    if solution.disturbance is not None:
        segments = with_filter(model, z, segments, weights, solution.disturbance, step)[0]
        weights = (weights > 0).astype(float)
    residuals = residuals_of(model, segments, step, z, starts)
    information, _, reduction = reduced(evaluated(model, segments, weights, step, z, starts), z, starts, 0.0)
    return Fit(*solution, segments, weights, information, reduction, residuals, cost_of(residuals, weights, z, starts))


def weights_of(segments: Segments, noise: np.ndarray, shares: np.ndarray) -> np.ndarray:
    """Of the residuals, 1/variance, 0 without a sample, (S, length, 13)."""
    return shares * segments.counts[:, :, SENSOR_OF_RESIDUAL] / noise**2


def scores_of(model: IdentificationModel, step: float, estimate: Fit) -> np.ndarray:
    """Gradient of each step, (S, length, P)."""
    z, starts = jnp.asarray(estimate.z), jnp.asarray(estimate.starts)
    weights, residuals, reduction = map(jnp.asarray, (estimate.weights, estimate.residuals, estimate.reduction))
    return np.asarray(scores(model, z, starts, estimate.segments, weights, residuals, reduction, step))
