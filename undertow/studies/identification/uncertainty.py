"""How sure an estimate is.

The deviations of least squares hold where residuals are white. Those of a vehicle are not: waves, tethers and what the
model lacks push for seconds. So each variance is multiplied by how much more the gradient of the cost scatters than
white residuals would make it, with its correlation in time counted, and by how much the estimates from parts of the
data scatter, where that is more than chance.
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from scipy import stats

from undertow.studies.identification.free_parameters import FreeParameter

LEVEL = 0.95  # of the intervals
_DETERMINED, _PARTLY = 0.5, 0.9  # deviation as a share of that beforehand
_MEMBER = 0.35  # component from which on a parameter belongs to a combination
_CHANCE = 0.05  # probability with which parts of the data scatter as much by chance
# Of the deviation beforehand: inputs and samples are averaged over steps, which bends the fastest motion; what white
# noise alone would let one know better is not known.
_RESOLUTION = 0.003
_LARGEST_SHARE = 0.25  # of a segment over which correlation is counted


class ParameterInterval(NamedTuple):
    """What is known of a parameter.

    Attributes:
        parameter: see there.
        value: estimate.
        low, high: of 95 %.
        deviation: of the value, in its unit.
        share: deviation as a share of that beforehand.
        shift: of the estimate, in deviations beforehand.
    """

    parameter: FreeParameter
    value: float
    low: float
    high: float
    deviation: float
    share: float
    shift: float

    @property
    def verdict(self) -> str:
        """`determined`, `partly`, or `unknown`: the data say less than was known before."""
        if self.share < _DETERMINED:
            return "determined"
        return "partly" if self.share < _PARTLY else "unknown"


class Uncertainty(NamedTuple):
    """How sure the unknowns are.

    Attributes:
        covariance: of the unknowns, whose variance beforehand is 1, (P, P).
        freedom: degrees of freedom of the deviations.
        inflation: factor on the deviations of white residuals, (P,).
        correlation_time: of the gradient, s.
    """

    covariance: np.ndarray
    freedom: float
    inflation: np.ndarray
    correlation_time: float

    def correlation(self, unknowns: Sequence[int]) -> np.ndarray:
        """Correlation matrix of some of the unknowns."""
        covariance = self.covariance[np.ix_(unknowns, unknowns)]
        scale = np.sqrt(np.diagonal(covariance))
        correlation = covariance / np.outer(scale, scale)
        np.fill_diagonal(correlation, 1.0)  # without rounding
        return correlation

    def intervals(self, parameters: Sequence[FreeParameter], z: np.ndarray) -> list[ParameterInterval]:
        """Of each parameter."""
        deviations = self._deviations(parameters)
        reach = self.reaches(parameters)
        return [_interval(p, z[i], deviations[i], reach[i]) for i, p in enumerate(parameters)]

    def reaches(self, parameters: Sequence[FreeParameter]) -> np.ndarray:
        """Half the interval of each parameter, in deviations beforehand."""
        return stats.t.ppf(0.5 + LEVEL / 2, self.freedom) * self._deviations(parameters)

    def _deviations(self, parameters: Sequence[FreeParameter]) -> np.ndarray:
        of_data = np.sqrt(np.diagonal(self.covariance))[: len(parameters)]
        return np.hypot(of_data, [p.resolution / p.deviation for p in parameters])


def _interval(parameter: FreeParameter, z: float, deviation: float, reach: float) -> ParameterInterval:
    value = float(parameter.value(z))
    low, high = float(parameter.value(z - reach)), float(parameter.value(z + reach))
    in_unit = deviation * parameter.deviation * (value if parameter.is_ratio else 1.0)
    return ParameterInterval(
        parameter, value, max(low, parameter.least), high, float(in_unit), float(deviation), float(z)
    )


def uncertainty_of(
    information: np.ndarray, scores: np.ndarray, step: float, parts: np.ndarray | None = None
) -> Uncertainty:
    """How sure unknowns are whose variance beforehand is 1.

    Args:
        information: second derivative of the cost, prior included, (P, P).
        scores: gradient of each step, (S, length, P).
        step: s.
        parts: estimates with one part of the data left out, (parts, P); None where there is only one part.
    """
    count = len(information)
    plain = np.linalg.inv(information)
    lags = _bandwidth(scores, plain)
    scatter = _scatter(scores, lags) + np.eye(count)
    sandwich = np.diagonal(plain @ scatter @ plain)
    variance = np.diagonal(plain)
    inflation = np.maximum(1.0, sandwich / variance)
    used = (scores != 0).any(axis=2).sum()
    freedom = max(3.0, used / (1.0 + 2.0 * lags) - count)
    if parts is not None and len(parts) > 2:
        inflation = np.maximum(inflation, _between_parts(parts, variance))
    inflation = np.minimum(inflation, np.maximum(1.0, 1.0 / variance))  # not less sure than beforehand
    root = np.sqrt(np.maximum(inflation, _RESOLUTION**2 / variance))
    return Uncertainty(root[:, None] * plain * root, float(freedom), root, float(lags * step))


def _bandwidth(scores: np.ndarray, plain: np.ndarray) -> int:
    """Steps over which the gradient is correlated: Andrews (1991), Eq. (6.2), for Bartlett weights, at most a share."""
    projected = scores @ plain
    first, second = projected[:, :-1], projected[:, 1:]
    energy = (projected**2).sum(axis=(0, 1))
    rho = np.clip((first * second).sum(axis=(0, 1)) / np.maximum(energy, 1e-300), 0.0, 0.99)
    variance = energy / energy.sum() if energy.sum() > 0 else energy
    alpha = float((variance * 4 * rho**2 / ((1 - rho) ** 2 * (1 + rho) ** 2)).sum())
    steps = scores.shape[0] * scores.shape[1]
    largest = max(1, int(_LARGEST_SHARE * scores.shape[1]))
    return min(largest, int(np.ceil(1.1447 * (alpha * steps) ** (1 / 3))))


def _scatter(scores: np.ndarray, lags: int) -> np.ndarray:
    """Variance of the whole gradient: Newey and West (1987), with Bartlett weights."""
    total = np.einsum("skp,skq->pq", scores, scores)
    for lag in range(1, lags + 1):
        shifted = np.einsum("skp,skq->pq", scores[:, lag:], scores[:, :-lag])
        total = total + (1 - lag / (lags + 1)) * (shifted + shifted.T)
    return total


def _between_parts(parts: np.ndarray, variance: np.ndarray) -> np.ndarray:
    """Variance that estimates with parts left out show (jackknife), as a factor, where it is more than chance."""
    number = len(parts)
    jackknife = (number - 1) / number * ((parts - parts.mean(axis=0)) ** 2).sum(axis=0)
    ratio = jackknife / variance
    critical = stats.f.ppf(1 - _CHANCE, number - 1, 1000)
    return np.where(ratio > critical, ratio, 1.0)


class Combination(NamedTuple):
    """A combination of parameters that the data do not determine.

    Attributes:
        names: of the parameters in it.
        weights: of each.
        share: of the deviation beforehand that is left.
    """

    names: tuple[str, ...]
    weights: tuple[float, ...]
    share: float

    def sentence(self) -> str:
        """In words."""
        if len(self.names) == 1:
            return f"{self.names[0]} is not determined by these data"
        together = f"{', '.join(self.names[:-1])} and {self.names[-1]}"
        same = all(weight > 0 for weight in self.weights) or all(weight < 0 for weight in self.weights)
        how = "their ratios" if same else "a trade-off between them"
        return f"of {together} the data determine {how} only"


def undetermined(information: np.ndarray, parameters: Sequence[FreeParameter]) -> list[Combination]:
    """Combinations of which the data say less than was known before: singular directions of the scaled information."""
    count = len(parameters)
    covariance = np.linalg.inv(information)[:count, :count]
    values, vectors = np.linalg.eigh(covariance)
    found = []
    for value, vector in zip(values[::-1], vectors.T[::-1], strict=True):
        if value < _DETERMINED**2:
            break
        members = np.flatnonzero(np.abs(vector) > _MEMBER)
        if not len(members):
            members = np.argsort(-np.abs(vector))[:3]
        order = members[np.argsort(-np.abs(vector[members]))]
        names = tuple(parameters[i].name for i in order)
        found.append(Combination(names, tuple(float(vector[i]) for i in order), float(np.sqrt(value))))
    return found
