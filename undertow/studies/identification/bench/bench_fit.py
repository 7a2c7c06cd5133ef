"""Fit of a thruster to bench records by SciPy's least squares, with a robust loss, and how sure it is.

Residuals of neighbouring rows are alike, since the form lacks something everywhere. So intervals come from how the
gradient scatters along the rows, and from how estimates differ when neighbouring rows are left out together.
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from jaxtyping import Float
from scipy import stats
from scipy.optimize import least_squares

from undertow.studies.identification.bench.bench_problem import BenchProblem
from undertow.studies.identification.bench.bench_table import BenchTable
from undertow.studies.identification.uncertainty import LEVEL, ParameterInterval, Uncertainty, uncertainty_of

_OUTLIER = 3.0  # standard deviations from which on a residual counts less
_FIRST_NOISE = 0.05  # of the largest value
_PASSES = 4  # of the noise
_MAD = 1.4826  # standard deviation of a normal distribution per median of sizes
_FOLDS = 8  # of settled rows, by voltage
_FOLDS_OF_RECORD = 4  # in time
_EVALUATIONS = 60
_INSIDE = 0.1  # distance of the begin from a bound, in deviations beforehand


class BenchFit(NamedTuple):
    """An estimate.

    Attributes:
        z: unknowns.
        noise: standard deviation of each measured quantity, (quantities,).
        errors: predicted less measured, (rows, quantities).
        converged: whether the solver came to rest.
    """

    z: Float[np.ndarray, " P"]
    noise: Float[np.ndarray, " quantities"]
    errors: Float[np.ndarray, "rows quantities"]
    converged: bool


class JudgedFit(NamedTuple):
    """An estimate with its intervals, and how it predicts rows that were left out.

    Attributes:
        problem: see there.
        fit: from all rows.
        uncertainty: of the unknowns.
        intervals: of the parameters, a dead zone that was read from the rows included.
        left_out: rms of the errors of rows that were not used, by measured quantity, in our units.
    """

    problem: BenchProblem
    fit: BenchFit
    uncertainty: Uncertainty
    intervals: tuple[ParameterInterval, ...]
    left_out: dict[str, float]

    def thrust_band(self, volts: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Settled thrust at voltages, N, and half of its 95 % interval."""
        thrust, slopes = self.problem.thrust(self.fit.z, volts)
        variance = np.einsum("ip,pq,iq->i", slopes, self.uncertainty.covariance, slopes)
        return thrust, stats.t.ppf(0.5 + LEVEL / 2, self.uncertainty.freedom) * np.sqrt(variance)

    def rms(self, quantity: str) -> float:
        """Of the errors of all rows in a measured quantity."""
        column = self.problem.form.measured.index(quantity)
        return _rms(self.fit.errors[:, column][self.problem.present[:, column]])


def fitted(problem: BenchProblem, used: np.ndarray | None = None, begin: BenchFit | None = None) -> BenchFit:
    """The estimate from the rows that are used (all without `used`); begins at another one, whose noise it takes."""
    present = problem.present if used is None else problem.present & used[:, None]
    z = np.zeros(len(problem.parameters)) if begin is None else begin.z
    noise = np.maximum(_FIRST_NOISE * problem.largest, problem.least_noise) if begin is None else begin.noise
    converged = False
    for _ in range(_PASSES if begin is None else 1):
        z, converged = _solved(problem, present, z, noise)
        if begin is None:
            noise = _noise(problem, problem.errors(z), present)
    return BenchFit(z, noise, problem.errors(z), converged)


def judged(problem: BenchProblem, fit: BenchFit) -> JudgedFit:
    """An estimate with its intervals and its errors on rows left out."""
    errors = np.full_like(fit.errors, np.nan)
    parts = []
    for fold in _folds(problem.tables):
        part = fitted(problem, ~fold, fit)
        errors[fold] = part.errors[fold]
        parts.append(part.z)
    scores, information = _scores(problem, fit)
    uncertainty = uncertainty_of(information, _in_segments(problem.tables, scores), 1.0, np.array(parts))
    left_out = {
        name: _rms(errors[:, i][problem.present[:, i]])
        for i, name in enumerate(problem.form.measured)
        if problem.present[:, i].any()
    }
    intervals = tuple(uncertainty.intervals(problem.parameters, fit.z))
    return JudgedFit(problem, fit, uncertainty, intervals, left_out)


def _solved(problem: BenchProblem, present: np.ndarray, z: np.ndarray, noise: np.ndarray) -> tuple[np.ndarray, bool]:
    """Unknowns of least squares, and whether the solver came to rest. The last residuals are those of the prior."""
    scale = present / noise
    count = len(z)

    def residuals(z):
        return np.concatenate([(problem.errors(z) * scale).ravel(), z])

    def jacobian(z):
        slopes = problem.slopes(z) * scale[..., None]
        return np.concatenate([slopes.reshape(-1, count), np.eye(count)])

    def loss(squares):
        value, weight, slope = _soft(squares)
        value[-count:], weight[-count:], slope[-count:] = squares[-count:], 1.0, 0.0
        return np.stack([value, weight, slope])

    least = np.array([parameter.least_z for parameter in problem.parameters])
    begin = np.maximum(z, least + _INSIDE)  # at its bound the method hardly moves
    solution = least_squares(
        residuals,
        begin,
        jac=jacobian,  # pyright: ignore[reportArgumentType] - a function, as SciPy documents
        bounds=(least, np.inf),
        loss=loss,  # pyright: ignore[reportArgumentType] - a function, as SciPy documents
        x_scale="jac",
        max_nfev=_EVALUATIONS,
    )
    return solution.x, bool(solution.success)


def _soft(squares: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Loss that grows linearly from some deviations on, and its derivatives by the square."""
    root = np.sqrt(1 + squares / _OUTLIER**2)
    return 2 * _OUTLIER**2 * (root - 1), 1 / root, -0.5 / (_OUTLIER**2 * root**3)


def _noise(problem: BenchProblem, errors: np.ndarray, present: np.ndarray) -> np.ndarray:
    sizes = [np.abs(errors[:, i][present[:, i]]) for i in range(errors.shape[1])]
    medians = np.array([_MAD * np.median(size) if len(size) else 1.0 for size in sizes])
    return np.maximum(medians, problem.least_noise)


def _scores(problem: BenchProblem, fit: BenchFit) -> tuple[np.ndarray, np.ndarray]:
    """Gradient of the cost of each row, (rows, P), and the second derivative of the cost, (P, P)."""
    residuals = fit.errors / fit.noise
    slopes = problem.slopes(fit.z) / fit.noise[:, None]
    weights = _soft(residuals**2)[1] * problem.present
    scores = np.einsum("rq,rq,rqp->rp", weights, residuals, slopes)
    information = np.einsum("rq,rqp,rqs->ps", weights, slopes, slopes) + np.eye(len(fit.z))
    return scores, information


def _in_segments(tables: Sequence[BenchTable], scores: np.ndarray) -> np.ndarray:
    """Scores in the order of the voltage at each supply, or of time: (segments, length, P), with zeros at the end."""
    segments, first = [], 0
    for table in tables:
        rows = first + np.arange(len(table.volts))
        first += len(rows)
        if table.time is not None:
            segments.append(rows)
            continue
        supplies = np.round(table.supply, 1)
        for supply in np.unique(supplies):
            own = np.flatnonzero(supplies == supply)
            segments.append(rows[own[np.argsort(table.volts[own], kind="stable")]])
    padded = np.zeros((len(segments), max(map(len, segments)), scores.shape[1]))
    for i, rows in enumerate(segments):
        padded[i, : len(rows)] = scores[rows]
    return padded


def _folds(tables: Sequence[BenchTable]) -> list[np.ndarray]:
    """Rows left out together, (rows,) each: neighbours in voltage of all settled rows, and in time of each record."""
    total = sum(len(table.volts) for table in tables)
    settled, records, first = [], [], 0
    for table in tables:
        rows = first + np.arange(len(table.volts))
        first += len(rows)
        if table.time is None:
            settled.append((rows, table.volts))
        else:
            records += np.array_split(rows, _FOLDS_OF_RECORD)
    blocks = list(records)
    if settled:
        rows, volts = (np.concatenate(arrays) for arrays in zip(*settled, strict=True))
        blocks += np.array_split(rows[np.argsort(volts, kind="stable")], min(_FOLDS, len(rows)))
    folds = []
    for block in blocks:
        fold = np.zeros(total, dtype=bool)
        fold[block] = True
        folds.append(fold)
    return folds


def _rms(errors: np.ndarray) -> float:
    return float(np.sqrt(np.mean(errors**2)))
