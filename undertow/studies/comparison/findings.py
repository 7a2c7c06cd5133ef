"""The findings of a comparison as plain data: medians, paired differences, failures and how the gains came about."""

import itertools
import math
from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
import xarray as xr

from undertow.core.status import Status
from undertow.studies.campaign.campaign_summary import median_interval
from undertow.studies.campaign.columns import ENDINGS, JUDGEMENTS
from undertow.studies.campaign.store_layout import SAMPLES
from undertow.studies.comparison.paired import FEWEST, Completion, PairedDifference, completions, differences
from undertow.studies.comparison.pareto import Front, fronts

COMPLETED = Status.OK.word


class Median(NamedTuple):
    """A metric of one candidate over the trials that it completed.

    Attributes:
        value: the median; NaN where the metric is never defined.
        low, high: 95 % interval of the median of the population, from order statistics; NaN with fewer than six trials.
        trials: how many are defined.
    """

    value: float
    low: float
    high: float
    trials: int


class Findings(NamedTuple):
    """What a comparison found.

    Attributes:
        dimension: what is compared: `controller`, `scenario`, or the swept key of a campaign file.
        names: of the candidates.
        trials: samples that each of them ran.
        all_equal: whether these are all equal, so that one of them tells all.
        units: metric -> unit, empty for a dimensionless number, in the order of tables.
        medians: metric -> candidate -> median.
        differences: every two candidates in every metric that is finite in all completed trials.
        completions: every two candidates, by the trials that only one of them completed.
        endings: candidate -> how its trials ended -> how many.
        failed_at: candidate -> median time at which its failed trials ended, s; NaN without any.
        successes: candidate -> trials within the scenario's criterion of success, and trials that were judged.
        tuning: candidate -> how its gains came about.
        differing: of scenarios that are compared as a whole: key -> the value in each.
        fronts: Pareto fronts of medians of an error against medians of an effort.
        nominal_model: sentence on what controllers know of a plant that varies; empty where it does not.
    """

    dimension: str
    names: tuple[str, ...]
    trials: int
    all_equal: bool
    units: dict[str, str]
    medians: dict[str, dict[str, Median]]
    differences: tuple[PairedDifference, ...]
    completions: tuple[Completion, ...]
    endings: dict[str, dict[str, int]]
    failed_at: dict[str, float]
    successes: dict[str, tuple[int, int]]
    tuning: dict[str, str]
    differing: dict[str, list[str]]
    fronts: tuple[Front, ...]
    nominal_model: str = ""

    def completed(self, name: str) -> int:
        """Number of completed trials of a candidate."""
        return self.endings[name].get(COMPLETED, 0)

    def pairs(self) -> list[tuple[str, str]]:
        """Every two candidates, the later one first."""
        return [(second, first) for first, second in itertools.combinations(self.names, 2)]

    def against(self, candidate: str, baseline: str) -> list[PairedDifference]:
        """Differences between two candidates, one per metric."""
        pair = (candidate, baseline)
        return [difference for difference in self.differences if (difference.candidate, difference.baseline) == pair]

    def data(self) -> dict[str, Any]:
        """The same as numbers, words and lists."""
        plain = self._asdict() | {"names": list(self.names)}
        plain["medians"] = {
            metric: {name: median._asdict() for name, median in by_name.items()}
            for metric, by_name in self.medians.items()
        }
        plain["differences"] = [
            difference._asdict() | {"established": difference.established} for difference in self.differences
        ]
        plain["completions"] = [completion._asdict() for completion in self.completions]
        plain["fronts"] = [front.data() for front in self.fronts]
        return plain


def find(
    dataset: xr.Dataset, dimension: str, metrics: Sequence[str], tuning: Mapping[str, str], differing: Mapping[str, Any]
) -> Findings:
    """The findings in the columns of a comparison, which have the dimensions `dimension` and `sample`."""
    names = tuple(map(str, dataset[dimension].values))
    rows = {name: dataset.isel({dimension: i}) for i, name in enumerate(names)}
    lasted = {name: trials["status"].values == int(Status.OK) for name, trials in rows.items()}
    values = {
        metric: {name: np.where(lasted[name], trials[metric].values, np.nan) for name, trials in rows.items()}
        for metric in metrics
    }
    constant = all(_constant(column) for by_name in values.values() for column in by_name.values())
    all_equal = constant and (bool(values) or dataset.sizes[SAMPLES] == 1)
    if all_equal:  # many copies of one trial prove no more than that trial
        values = {metric: {name: column[:1] for name, column in by_name.items()} for metric, by_name in values.items()}
    failure_times = {name: trials["ended"].values[~lasted[name]] for name, trials in rows.items()}
    medians = {metric: _medians(by_name) for metric, by_name in values.items()}
    plain = {metric: {name: median.value for name, median in by_name.items()} for metric, by_name in medians.items()}
    finite = {metric: by_name for metric, by_name in values.items() if _finite(by_name)}
    return Findings(
        dimension=dimension,
        names=names,
        trials=dataset.sizes[SAMPLES],
        all_equal=all_equal,
        units={metric: dataset[metric].attrs["units"].removesuffix("1") for metric in metrics},
        medians=medians,
        differences=tuple(differences(finite)),
        completions=tuple(completions(lasted)) if not all_equal else (),
        endings={name: _counts(trials["status"].values, ENDINGS) for name, trials in rows.items()},
        failed_at={name: float(np.median(times)) if times.size else math.nan for name, times in failure_times.items()},
        successes={name: _successes(trials["success"].values) for name, trials in rows.items()},
        tuning=dict(tuning),
        differing=dict(differing),
        fronts=fronts(plain, {name: bool(completed.all()) for name, completed in lasted.items()}),
    )


def _finite(by_name: Mapping[str, np.ndarray]) -> bool:
    """Whether no value is infinite: to leave out the trials that do not settle would favour who does not."""
    return not any(np.isinf(values).any() for values in by_name.values())


def _constant(values: np.ndarray) -> bool:
    return bool((values == values[0]).all() or np.isnan(values).all())


def _medians(by_name: Mapping[str, np.ndarray]) -> dict[str, Median]:
    return {name: _median(values) for name, values in by_name.items()}


def _median(values: np.ndarray) -> Median:
    defined = values[~np.isnan(values)]
    if not defined.size:
        return Median(math.nan, math.nan, math.nan, 0)
    low, high = median_interval(defined) if defined.size >= FEWEST else (math.nan, math.nan)
    return Median(float(np.median(defined)), low, high, defined.size)


def _counts(codes: np.ndarray, words: Mapping[int, str]) -> dict[str, int]:
    return {word: int((codes == code).sum()) for code, word in words.items() if (codes == code).any()}


def _successes(codes: np.ndarray) -> tuple[int, int]:
    counts = _counts(codes, JUDGEMENTS)
    return counts.get("within", 0), counts.get("within", 0) + counts.get("not_within", 0)
