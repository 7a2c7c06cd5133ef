"""Median and intervals over seeds."""

from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np
from scipy.stats import binom

_CONFIDENCE = 0.95
_SPREAD = (0.05, 0.95)


class Spread(NamedTuple):
    """One metric over seeds; a run that ended early counts as infinite."""

    median: float
    low: float  # 5 % of the seeds lie below
    high: float  # 5 % lie above
    median_low: float  # 95 % confidence interval of the median, from order statistics
    median_high: float


class Summary(NamedTuple):
    """One variant over seeds."""

    seeds: int
    failures: int  # runs that ended early
    metrics: Mapping[str, Spread]

    def __getitem__(self, metric: str) -> float:  # pyright: ignore[reportIncompatibleMethodOverride]
        """Median of a metric."""
        return self.metrics[metric].median

    def plain(self) -> dict[str, Any]:
        """For results.json."""
        spreads = {name: spread._asdict() for name, spread in self.metrics.items()}
        return {"seeds": self.seeds, "failures": self.failures, "metrics": spreads}


def spread(values) -> Spread:
    """Median, 5 and 95 %, and the interval that holds the median of the population with 95 % confidence.

    Quantiles are values that occurred (no interpolation), so that infinite ones do no harm; the median of an even
    number is the mean of the two in the middle.
    """
    ordered = np.sort(np.asarray(values, dtype=float))
    count = ordered.size
    low, high = np.quantile(ordered, _SPREAD, method="inverted_cdf")
    first = median_rank(count)
    middle = ordered[[(count - 1) // 2, count // 2]].mean()
    return Spread(*map(float, (middle, low, high, ordered[first - 1], ordered[count - first])))


def median_rank(count: int) -> int:
    """Rank r >= 1 such that the r-th smallest and r-th largest of `count` values enclose the median.

    The number of values below the median is binomial (count, 1/2), whatever their distribution; with few values the
    smallest and largest are taken.
    """
    return max(int(binom.ppf((1 - _CONFIDENCE) / 2, count, 0.5)), 1)


def summary(outcomes: Mapping[str, np.ndarray], metrics: tuple[str, ...]) -> Summary:
    """Chosen metrics of `runner.run` over its seeds."""
    status = outcomes["status"]
    return Summary(len(status), int((status != 0).sum()), {name: spread(outcomes[name]) for name in metrics})
