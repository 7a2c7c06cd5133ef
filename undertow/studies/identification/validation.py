"""How well a model predicts dives: as a free run over a whole dive, and some seconds ahead."""

from typing import NamedTuple

import jax
import numpy as np

from undertow.studies.identification.dive import RESIDUALS, SENSOR_OF_RESIDUAL, Dive
from undertow.studies.identification.model import NUISANCES, IdentificationModel, all_residuals
from undertow.studies.identification.segments import Segments, segments_of, whole

HORIZONS = (1.0, 5.0, 10.0)  # s
AXES = RESIDUALS[6:12]  # u ... r, of which fits are given
_BOUND = (
    3.5  # standard errors; the largest of twenty correlations and those with some inputs is below it in nine of ten
)
_COLUMN_OF_VALUE = {axis: 7 + i for i, axis in enumerate(AXES)}


class PredictionErrors(NamedTuple):
    """Of one model on one dive.

    Attributes:
        fit: 100 (1 - rms of the error / standard deviation) of a free run over the whole dive, in %, by axis of `AXES`;
            NaN where nothing was measured, -infinity where the free run diverges. 100 is perfect, and 0 no better than
            the mean.
        ahead: rms of the error after each of `HORIZONS`, (3, 13), in the units of residuals.
        free_run: residuals of the free run, (steps, 13); NaN without a sample.
    """

    fit: dict[str, float]
    ahead: np.ndarray
    free_run: np.ndarray

    def error(self, axis: str) -> np.ndarray:
        """Of the free run in one of `AXES`, (steps,); NaN without a sample."""
        return self.free_run[:, RESIDUALS.index(axis)]


def whole_values(dive: Dive, axis: str) -> np.ndarray:
    """Measured velocity of one of `AXES` at each step of a dive; any number without a sample."""
    return dive.values[:, _COLUMN_OF_VALUE[axis]]


def prediction_errors(model: IdentificationModel, z: np.ndarray, dive: Dive) -> PredictionErrors:
    """Errors of a model on a dive that it need not know: without current and biases, from the measured begin.

    Args:
        model: see there.
        z: parameters of the vehicle.
        dive: see there.
    """
    unknowns = np.concatenate([z, np.zeros(len(NUISANCES))])
    only = whole(dive)
    free_run = _measured_only(_residuals(model, unknowns, only, dive.step), only)[0]
    is_measured = only.counts[0][:, SENSOR_OF_RESIDUAL] > 0
    fit = {}
    for axis in AXES:
        there = is_measured[:, RESIDUALS.index(axis)]
        fit[axis] = _fit(free_run[there, RESIDUALS.index(axis)], whole_values(dive, axis)[there])
    return PredictionErrors(fit, _ahead(model, unknowns, dive), free_run)


def _fit(error: np.ndarray, values: np.ndarray) -> float:
    """100 (1 - rms of the error / standard deviation of the values), %."""
    spread = float(values.std()) if len(values) else 0.0
    if spread == 0:
        return float("nan")
    return 100 * (1 - float(np.sqrt((error**2).mean())) / spread) if np.isfinite(error).all() else float("-inf")


def _ahead(model: IdentificationModel, unknowns: np.ndarray, dive: Dive) -> np.ndarray:
    """Rms of the errors around each horizon, over starts all along the dive."""
    longest = HORIZONS[-1]
    if dive.duration < 2 * longest:
        return np.full((len(HORIZONS), len(RESIDUALS)), np.nan)
    segments = segments_of([dive], longest)
    errors = _measured_only(_residuals(model, unknowns, segments, dive.step), segments)
    rows = []
    for horizon in HORIZONS:
        last = round(horizon / dive.step)
        window = errors[:, max(0, last - round(0.5 / dive.step)) : last]
        rows.append(_rms(window.reshape(-1, len(RESIDUALS))))
    return np.stack(rows)


def _rms(errors: np.ndarray) -> np.ndarray:
    """Of each column, over what is not NaN; NaN where all is."""
    counts = np.isfinite(errors).sum(axis=0)
    squares = np.nansum(errors**2, axis=0)
    return np.where(counts > 0, np.sqrt(squares / np.maximum(counts, 1)), np.nan)


def _residuals(model: IdentificationModel, unknowns: np.ndarray, segments: Segments, step: float) -> np.ndarray:
    starts = np.zeros((len(segments.dive), 12))
    of_dive = segments._replace(dive=np.zeros_like(segments.dive))
    return np.array(jax.device_get(all_residuals(model, unknowns, starts, of_dive, step)))


def _measured_only(residuals: np.ndarray, segments: Segments) -> np.ndarray:
    """Residuals where there are samples, NaN elsewhere."""
    return np.where(segments.counts[:, :, SENSOR_OF_RESIDUAL] > 0, residuals, np.nan)


class Whiteness(NamedTuple):
    """Whether residuals of a kind look like noise.

    Attributes:
        correlation: largest autocorrelation over the first lags.
        with_inputs: largest correlation with an input over the first lags.
        bound: for white residuals.
    """

    correlation: float
    with_inputs: float
    bound: float

    @property
    def is_white(self) -> bool:
        """Whether both are below the bound."""
        return max(self.correlation, self.with_inputs) < self.bound


def whiteness(residuals: np.ndarray, inputs: np.ndarray, lags: int = 20) -> Whiteness:
    """Autocorrelation of residuals and their correlation with inputs, Ljung (1999), ch. 16.6.

    Args:
        residuals: of consecutive samples, (n,).
        inputs: at the same times, (n, N).
        lags: of both.
    """
    e = residuals - residuals.mean()
    energy = (e**2).sum()
    auto = [abs((e[lag:] * e[:-lag]).sum()) / max(energy, 1e-300) for lag in range(1, lags + 1)]
    cross = [0.0]
    for column in (inputs - inputs.mean(axis=0)).T:
        scale = np.sqrt(energy * (column**2).sum())
        if scale > 0:
            cross += [abs((e[lag:] * column[: len(column) - lag]).sum()) / scale for lag in range(lags + 1)]
    return Whiteness(float(max(auto)), float(max(cross)), _BOUND / float(np.sqrt(len(e))))
