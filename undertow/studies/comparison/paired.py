"""Paired statistics: differences of metrics between candidates that ran the same samples with the same seeds."""

import itertools
import math
from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
from scipy.stats import binomtest, bootstrap, wilcoxon

LEVEL = 0.05  # of significance; the intervals hold 95 %

# Fewer values have no 95 % interval of the median: all of them are on one side of it once in 2^(n - 1) times.
FEWEST = 6

_RESAMPLES, _SEED = 2000, 0
_AT_ONCE = 1_000_000  # numbers that the bootstrap keeps in memory


class PairedDifference(NamedTuple):
    """One metric of a candidate less that of another, over the trials that both completed.

    Attributes:
        metric: name of the metric.
        candidate, baseline: whose values are compared: differences are candidate minus baseline.
        pairs: trials that both completed and where the metric is defined for both.
        left_out: the other trials.
        median: of the differences, in the unit of the metric; NaN without pairs.
        low, high: 95 % bootstrap interval of the median (percentiles); NaN with fewer than six pairs.
        relative: median of the differences as shares of the baseline's values; NaN unless all of these are
            positive.
        smaller, larger: pairs in which the candidate's value is smaller, or larger, than the baseline's.
        p: of the Wilcoxon signed-rank test, two-sided; NaN where all differences are zero, or with fewer
            than six pairs, which can establish nothing.
        p_holm: the same with Holm's correction for all tests of the comparison.
    """

    metric: str
    candidate: str
    baseline: str
    pairs: int
    left_out: int
    median: float
    low: float
    high: float
    relative: float
    smaller: int
    larger: int
    p: float
    p_holm: float

    @property
    def established(self) -> bool:
        """Whether the test is below 5 % after correction and the interval excludes zero."""
        return self.p_holm < LEVEL and (self.low > 0 or self.high < 0)


class Completion(NamedTuple):
    """Which of two candidates completed trials that the other did not.

    Attributes:
        candidate, baseline: the two.
        only_candidate, only_baseline: trials that one of them alone completed.
        p: of McNemar's exact test, two-sided; NaN where there are none.
        p_holm: the same with Holm's correction for every two candidates.
    """

    candidate: str
    baseline: str
    only_candidate: int
    only_baseline: int
    p: float
    p_holm: float


def completions(completed: Mapping[str, np.ndarray]) -> list[Completion]:
    """How the completed trials of every two candidates differ; one entry per sample, in the same order."""
    uncorrected = []
    for baseline, candidate in itertools.combinations(completed, 2):
        candidate_only = int((completed[candidate] & ~completed[baseline]).sum())
        baseline_only = int((completed[baseline] & ~completed[candidate]).sum())
        # McNemar: only the trials that one of the two completed tell them apart, each with even odds if they are equal.
        discordant = candidate_only + baseline_only
        p = float(binomtest(candidate_only, discordant).pvalue) if discordant else math.nan
        uncorrected.append(Completion(candidate, baseline, candidate_only, baseline_only, p, math.nan))
    corrected = holm([completion.p for completion in uncorrected])
    return [completion._replace(p_holm=p) for completion, p in zip(uncorrected, corrected, strict=True)]


def differences(values: Mapping[str, Mapping[str, np.ndarray]]) -> list[PairedDifference]:
    """Differences of every metric between every two candidates.

    Args:
        values: metric -> candidate -> value of each sample, the same samples in the same order; NaN where the trial
            failed or has no such metric.
    """
    names = dict.fromkeys(name for columns in values.values() for name in columns)
    uncorrected = [
        _difference(metric, candidate, baseline, by_name[candidate], by_name[baseline])
        for baseline, candidate in itertools.combinations(names, 2)
        for metric, by_name in values.items()
    ]
    corrected = holm([difference.p for difference in uncorrected])
    return [difference._replace(p_holm=p) for difference, p in zip(uncorrected, corrected, strict=True)]


def _difference(metric: str, candidate: str, baseline: str, first: np.ndarray, second: np.ndarray) -> PairedDifference:
    finite = np.isfinite(first) & np.isfinite(second)
    first, second = first[finite], second[finite]
    pair_differences = first - second
    low, high = median_interval(pair_differences)
    return PairedDifference(
        metric=metric,
        candidate=candidate,
        baseline=baseline,
        pairs=int(finite.sum()),
        left_out=int((~finite).sum()),
        median=float(np.median(pair_differences)) if pair_differences.size else math.nan,
        low=low,
        high=high,
        relative=float(np.median(pair_differences / second))
        if pair_differences.size and (second > 0).all()
        else math.nan,
        smaller=int((pair_differences < 0).sum()),
        larger=int((pair_differences > 0).sum()),
        p=rank_test(pair_differences),
        p_holm=math.nan,
    )


def median_interval(values: np.ndarray) -> tuple[float, float]:
    """95 % bootstrap interval of the median (percentiles of 2000 resamples); NaN for fewer than six values."""
    if values.size < FEWEST:
        return math.nan, math.nan
    result: Any = bootstrap(
        (values,),
        np.median,
        n_resamples=_RESAMPLES,
        batch=max(1, _AT_ONCE // values.size),
        confidence_level=1 - LEVEL,
        method="percentile",
        rng=np.random.default_rng(_SEED),
    )
    return float(result.confidence_interval.low), float(result.confidence_interval.high)


def rank_test(pair_differences: np.ndarray) -> float:
    """Two-sided p of the Wilcoxon signed-rank test (1945); NaN where all are zero, and for fewer than six values."""
    if pair_differences.size < FEWEST or not pair_differences.any():
        return math.nan
    return float(wilcoxon(pair_differences).pvalue)  # pyright: ignore[reportAttributeAccessIssue]


def holm(p_values: Sequence[float]) -> list[float]:
    """p values with the step-down correction of Holm (1979) for all tests that were made; NaN stands for none."""
    tested = [i for i, p in enumerate(p_values) if not math.isnan(p)]
    corrected = list(p_values)
    largest = 0.0
    # The smallest p is multiplied by the number of tests, the next by one less, and so on; none falls below an earlier.
    for rank, i in enumerate(sorted(tested, key=lambda i: p_values[i])):
        largest = max(largest, min(1.0, (len(tested) - rank) * p_values[i]))
        corrected[i] = largest
    return corrected
