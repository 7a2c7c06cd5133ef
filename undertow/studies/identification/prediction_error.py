"""The estimate by prediction errors: a Kalman filter follows the motion, and its innovations are made small.

For dives on a tether or among eddies: forces that no log has push the vehicle, as strong and as fast as makes the
measurements most likely. Ljung (1999), sections 7.2 and 7.4.
"""

from collections.abc import Callable

import jax
import jax.numpy as jnp
import numpy as np
from scipy.optimize import minimize

from undertow.core.errors import BadInput
from undertow.studies.identification.dive import SENSOR_OF_RESIDUAL
from undertow.studies.identification.fit import Fit, Solution, completed, weights_of
from undertow.studies.identification.kalman_gains import Disturbance, FilterRun, unlikelihood, with_filter
from undertow.studies.identification.least_squares import cost_of, evaluated, improved, residuals_of
from undertow.studies.identification.model import IdentificationModel
from undertow.studies.identification.residual_noise import SMALLEST_NOISE, first_noise, outlier_shares
from undertow.studies.identification.segments import Segments

FIRST_DISTURBANCE = Disturbance(np.repeat([0.1, 0.3], 3), 2.0)  # m/s^2 and rad/s^2; s
_FACTOR = np.log(100.0)  # by which a noise may differ from where a search begins, up or down
_VAGUE = 2.0  # standard deviation of the logarithm of a noise beforehand
_ROUNDS = 12  # of noise and unknowns in turn
_STEPS = 3  # of the unknowns in a round
_SEARCHED = 25  # evaluations of a search for the noise
_CONVERGED = 0.05  # change of an unknown in a round, in standard deviations
_NOISE_CONVERGED = 0.05  # largest relative change of a noise


def filter_fit(
    model: IdentificationModel,
    segments: Segments,
    step: float,
    z: np.ndarray,
    least: np.ndarray,
    noise: np.ndarray,
    disturbance: Disturbance = FIRST_DISTURBANCE,
    watch: Callable[[int, float], None] = lambda iteration, cost: None,
) -> Fit:
    """The unknowns that leave the innovations of a filter smallest, given what was known beforehand.

    Args:
        model: see there.
        segments: of the dives.
        step: s.
        z: where to begin; the estimate by output error is near enough.
        least: smallest numbers.
        noise: standard deviation of each kind of sample at first, (13,); infinite without samples.
        disturbance: at first.
        watch: called with the iteration and the cost.

    Raises:
        BadInput: the filter diverges.
    """
    counts = segments.counts[:, :, SENSOR_OF_RESIDUAL]
    starts = np.zeros((len(segments.dive), 12))
    is_measured = (counts > 0).astype(float)
    shares = np.ones(counts.shape)
    damping, converged, iteration = 1e-3, False, 0
    for iteration in range(1, _ROUNDS + 1):
        _, run = with_filter(model, z, segments, weights_of(segments, noise, shares), disturbance, step)
        shares = outlier_shares(run.innovations, counts)
        new_noise, new_disturbance = _likeliest(run, shares * counts, noise, disturbance, step)
        weights = weights_of(segments, new_noise, shares)
        filtered, _ = with_filter(model, z, segments, weights, new_disturbance, step)
        begun = z
        residuals = residuals_of(model, filtered, step, z, starts)
        information = np.eye(len(z))
        for _ in range(_STEPS):
            cost = cost_of(residuals, is_measured, z, starts)
            if not np.isfinite(cost):
                hint = "Use output_error, or a shorter `step`"
                raise BadInput("method", "suit the logs", "prediction_error, whose filter diverges", hint=hint)
            watch(iteration, cost)
            parts = evaluated(model, filtered, is_measured, step, z, starts)
            information = parts.aa.sum(axis=0) + np.eye(len(z))
            trial = improved(model, filtered, parts, is_measured, step, z, starts, least, damping, cost)
            if trial is None:
                break
            z, residuals, damping = trial.z, trial.residuals, trial.damping
        deviations = np.sqrt(np.diagonal(np.linalg.inv(information)))
        change = _largest_change(_numbers(noise, disturbance), _numbers(new_noise, new_disturbance))
        noise, disturbance = new_noise, new_disturbance
        if change < _NOISE_CONVERGED and (np.abs(z - begun) / deviations).max() < _CONVERGED:
            converged = True
            break
    return completed(model, segments, step, Solution(z, starts, noise, shares, iteration, converged, disturbance))


def _numbers(noise: np.ndarray, disturbance: Disturbance) -> np.ndarray:
    """Noise of the samples and of the disturbance, and its correlation time, (20,)."""
    return np.concatenate([noise, disturbance.deviations, [disturbance.correlation_time]])


def _largest_change(before: np.ndarray, after: np.ndarray) -> float:
    finite = np.isfinite(before)
    return float(np.abs(after[finite] / before[finite] - 1).max())


def _likeliest(run: FilterRun, counts: np.ndarray, noise: np.ndarray, disturbance: Disturbance, step: float):
    """Noise of samples and disturbance that makes the measurements most likely, near a run of the filter.

    Args:
        run: of the filter.
        counts: samples, outliers by their shares, (S, length, 13).
        noise, disturbance: of that run.
        step: s.
    """
    numbers = _numbers(noise, disturbance)
    sensed = np.isfinite(numbers)
    begin = np.log(numbers[sensed])
    usual = np.log(_numbers(first_noise(counts), FIRST_DISTURBANCE)[sensed])
    run_kept = float(disturbance.kept(step))

    def evaluated_at(logarithms):
        arrays = (jnp.asarray(logarithms), jnp.asarray(usual), jnp.asarray(sensed), run, jnp.asarray(counts))
        value, slope = _objective(*arrays, run_kept, step)
        return float(value), np.asarray(slope, dtype=float)

    lowest = np.minimum(np.maximum(begin - _FACTOR, np.log(SMALLEST_NOISE)), begin)
    found = minimize(
        evaluated_at,
        begin,
        jac=True,
        method="L-BFGS-B",
        bounds=list(zip(lowest, begin + _FACTOR, strict=True)),
        options={"maxfun": _SEARCHED},
    )
    likeliest = np.full(len(numbers), np.inf)
    likeliest[sensed] = np.exp(found.x)
    return likeliest[: len(noise)], Disturbance(likeliest[len(noise) : -1], float(likeliest[-1]))


@jax.jit
def _objective(logarithms, usual, sensed, run: FilterRun, counts, run_kept, step):
    """Minus the logarithm of the likelihood, with what noise is beforehand, and its slope."""

    def value(logarithms):
        numbers = jnp.where(sensed, jnp.exp(logarithms[jnp.cumsum(sensed) - 1]), 1.0)
        noise, disturbance = numbers[:-7], Disturbance(numbers[-7:-1], numbers[-1])
        beforehand = 0.5 * (((logarithms - usual) / _VAGUE) ** 2).sum()
        return unlikelihood(disturbance, counts / noise[None, None, :] ** 2, run, run_kept, step) + beforehand

    return jax.value_and_grad(value)(logarithms)
