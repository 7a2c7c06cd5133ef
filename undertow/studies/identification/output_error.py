"""The estimate by output error, over segments whose begin is free."""

from collections.abc import Callable

import numpy as np

from undertow.core.errors import BadInput
from undertow.studies.identification.dive import SENSOR_OF_RESIDUAL
from undertow.studies.identification.fit import Fit, Solution, completed, weights_of
from undertow.studies.identification.least_squares import cost_of, evaluated, improved, residuals_of
from undertow.studies.identification.model import IdentificationModel
from undertow.studies.identification.residual_noise import first_noise, noise_of, outlier_shares
from undertow.studies.identification.segments import Segments

_SURPRISE = 5.0  # standard deviations, beyond which a residual says no more
_FASTEST = 2.0  # factor by which the noise may change in an iteration
_ITERATIONS = 60
_REWEIGHTED = 20  # iterations after which noise and outliers stay: where the model lacks something, they may alternate
_CONVERGED = 0.05  # decrease of the cost; 0.5 is one standard deviation of a parameter
_RELATIVE = 5e-5  # the same as a share of the cost, where residuals are not white
_NOISE_CONVERGED = 0.02  # largest relative change of a noise


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

    Raises:
        BadInput: the motion diverges where the unknowns begin.
    """
    starts = np.zeros((len(segments.dive), 12))
    counts = segments.counts[:, :, SENSOR_OF_RESIDUAL]
    z = np.maximum(z, least)
    residuals = residuals_of(model, segments, step, z, starts)
    if not np.isfinite(residuals[counts > 0]).all():
        hint = "Check units and signs, and leave out where it tumbles; a shorter step or segment may help"
        raise BadInput("log", "have a motion that the vehicle file can follow", "one in which it diverges", hint=hint)
    noise = first_noise(counts) if noise is None else noise
    shares = outlier_shares(residuals, counts)
    damping, converged, iteration = 1e-3, False, 0
    for iteration in range(1, _ITERATIONS + 1):
        weights = weights_of(segments, noise, shares)
        cost = cost_of(residuals, weights, z, starts)
        watch(iteration, cost)
        parts = evaluated(model, segments, weights, step, z, starts)
        trial = improved(model, segments, parts, weights, step, z, starts, least, damping, cost)
        small = trial is None
        if trial is not None:
            small = cost - trial.cost < max(_CONVERGED, _RELATIVE * cost)
            z, starts, residuals, damping = trial.z, trial.starts, trial.residuals, trial.damping
        steady = True
        if iteration <= _REWEIGHTED:
            shares = outlier_shares(residuals, counts)
            new_noise = np.clip(noise_of(residuals, counts, shares), noise / _FASTEST, noise * _FASTEST)
            finite = np.isfinite(new_noise)
            steady = np.abs(new_noise[finite] / noise[finite] - 1).max() < _NOISE_CONVERGED
            noise = new_noise
        if steady and small:
            converged = True
            break
    return completed(model, segments, step, Solution(z, starts, noise, shares, iteration, converged))


def first_errors(model: IdentificationModel, segments: Segments, step: float, z: np.ndarray) -> float:
    """Sum of squared residuals over usual noise, each at most `_SURPRISE` squared, from the guessed begins.

    It is infinite where a segment diverges.

    Args:
        model, segments, step, z: as above.
    """
    counts = segments.counts[:, :, SENSOR_OF_RESIDUAL]
    residuals = residuals_of(model, segments, step, z, np.zeros((len(segments.dive), 12)))
    squares = np.where(counts > 0, counts * residuals**2 / first_noise(counts) ** 2, 0.0)
    return float(np.minimum(squares, _SURPRISE**2).sum()) if np.isfinite(squares).all() else float("inf")
