"""Summary of a campaign: distributions, sensitivities, requirements, failures and the worst trials."""

import itertools
from collections.abc import Iterable, Mapping
from typing import Any

import numpy as np
import scipy  # its parts are loaded when they are used
import xarray as xr

from undertow.studies.campaign.columns import ENDINGS, JUDGEMENTS
from undertow.studies.campaign.random_scalars import realized_scalars
from undertow.studies.campaign.requirements import verdict
from undertow.studies.campaign.store_results import Results
from undertow.studies.campaign.task import reasons
from undertow.studies.campaign.trial_results import XLA
from undertow.studies.campaign.trials import Trials

QUANTILES = (0.05, 0.5, 0.95)

# Completed trials, the first ones, of which correlations are computed: their standard error is then 0.003.
_CORRELATED = 100_000


def quantiles(values: np.ndarray) -> dict[str, float]:
    """5 %, 50 % and 95 % quantiles of numbers, without undefined ones; some may be infinite."""
    defined = values[~np.isnan(values)]
    method: Any = "linear" if np.isfinite(defined).all() else "higher"
    estimates = np.quantile(defined, QUANTILES, method=method) if defined.size else np.full(len(QUANTILES), np.nan)
    return dict(zip(map(str, QUANTILES), estimates.tolist(), strict=True))


def median_interval(values: np.ndarray, confidence: float = 0.95) -> tuple[float, float]:
    """Interval that holds the median of the population, whatever its distribution; some values may be infinite.

    The number of values below the median is binomial (count, 1/2), so the r-th smallest and r-th largest enclose it;
    with few values the smallest and largest are taken. David and Nagaraja (2003), section 7.1.
    """
    ordered = np.sort(values)
    below = scipy.special.bdtr(np.arange(ordered.size // 2 + 1), ordered.size, 0.5)  # probability of at most so many
    rank = max(int(np.argmax(below >= (1 - confidence) / 2)), 1)
    return float(ordered[rank - 1]), float(ordered[-rank])


def defined_quantiles(rows: xr.Dataset, metrics: Iterable[str], which: np.ndarray) -> dict[str, dict[str, float]]:
    """Quantiles of metrics over some of the rows; what is defined for none of them is not there."""
    chosen = {name: rows[name].values[which] for name in metrics}
    return {name: quantiles(values) for name, values in chosen.items() if not np.isnan(values).all()}


def correlations(results: Results, realized: Mapping[str, np.ndarray]) -> dict[str, dict[str, float]]:
    """Rank correlation (Spearman) of every metric with every input, mean over the combinations.

    Only the first 100 000 completed trials count.

    The inputs are the sampled numbers, then the scalars that the seeds determine, those with most effect first.

    Args:
        results: of the campaign.
        realized: see `realized_scalars`; one value per completed trial.
    """
    sampled = {key: results.rows[f"vary:{key}"] for key in results.campaign.vary}
    columns = {key: column.values[results.lasted] for key, column in sampled.items() if "choices" not in column.attrs}
    of_vary = _correlations(results, columns)
    of_seeds = _correlations(results, realized)
    effect = lambda key: max(map(abs, of_seeds[key].values()))
    return of_vary | {key: of_seeds[key] for key in sorted(of_seeds, key=effect, reverse=True)}


def _correlations(results: Results, columns: Mapping[str, np.ndarray]) -> dict[str, dict[str, float]]:
    """Input -> metric -> rank correlation, for columns with one value per completed trial."""
    by_input: dict[str, dict[str, float]] = {}
    numbers = results.combinations[results.lasted][:_CORRELATED]
    columns = {key: column[:_CORRELATED] for key, column in columns.items()}
    metrics = {name: results.rows[name].values[results.lasted][:_CORRELATED] for name in results.metrics}
    for (key, column), (name, values) in itertools.product(columns.items(), metrics.items()):
        defined = np.isfinite(column) & np.isfinite(values)
        groups = [defined & (numbers == number) for number in np.unique(numbers)]
        pairs = [(column[group], values[group]) for group in groups]
        # Without three points, or where one of the two is constant, there is no rank correlation.
        coefficients = [
            float(scipy.stats.spearmanr(x, y)[0])  # pyright: ignore[reportArgumentType] - SciPy's result
            for x, y in pairs
            if len(x) > 2 and np.ptp(x) > 0 and np.ptp(y) > 0
        ]
        if coefficients:
            by_input.setdefault(key, {})[name] = sum(coefficients) / len(coefficients)
    return by_input


def by_choice(results: Results) -> dict[str, dict[str, Any]]:
    """Trials, failures and metrics for every entry of a choice, over all combinations."""
    by_key: dict[str, dict[str, Any]] = {}
    for key in results.campaign.vary:
        column = results.rows[f"vary:{key}"]
        for i, word in enumerate(column.attrs.get("choices", ())):
            chosen = column.values == i
            lasted, failed = chosen & results.lasted, chosen & results.ran & ~results.lasted
            metrics = defined_quantiles(results.rows, results.metrics, lasted)
            counts = {"trials": int(chosen.sum()), "failed": int(failed.sum())}
            by_key.setdefault(key, {})[word] = counts | {"metrics": metrics}
    return by_key


_WORST = 5


def summary(results: Results, campaign_trials: Trials) -> dict[str, Any]:
    """The contents of summary.json; the trials tell why some were invalid."""
    trials = results.rows["trial"].values
    invalid, lasted = trials[~results.ran], trials[results.lasted]
    return {
        "trials": results.total,
        "done": results.rows.sizes["trial"],
        "status": endings(results.rows),
        "nominal_model": campaign_trials.nominal_model(),
        "by_xla": int((results.rows["backend"].values == XLA).sum()),
        "invalid": [group._asdict() for group in reasons(campaign_trials, invalid)],  # pyright: ignore[reportArgumentType] - an array serves as rows
        "combinations": [_combination(results, number) for number in np.unique(results.combinations)],
        "sensitivity": correlations(results, realized_scalars(campaign_trials, lasted)),  # pyright: ignore[reportArgumentType] - likewise
        "choices": by_choice(results),
        "worst": [int(trial) for trial in _worst(results)],
    }


def endings(rows: xr.Dataset) -> dict[str, int]:
    """Number of trials by status; empty before the first is done."""
    codes = rows["status"].values if "status" in rows else np.zeros(0)
    return {word: int((codes == code).sum()) for code, word in ENDINGS.items() if (codes == code).any()}


def _combination(results: Results, number: int) -> dict[str, Any]:
    """Distributions and requirements of one combination of `cross`."""
    selected = results.combinations == number
    rows = results.rows if selected.all() else results.rows.isel(trial=selected)
    lasted, ran = results.lasted[selected], results.ran[selected]
    return {
        "values": dict(zip(results.campaign.axes, results.named(number), strict=True)),
        "trials": int(lasted.size),
        "status": endings(rows),
        "failed": int((ran & ~lasted).sum()),
        "invalid": int((~ran).sum()),
        "metrics": defined_quantiles(rows, results.metrics, lasted),
        "success": {word: int((rows["success"].values == code).sum()) for code, word in JUDGEMENTS.items()},
        "requirements": [
            verdict(rows[[name]].isel(trial=ran), name, required)
            for name, required in results.campaign.requirements.items()
        ],
    }


def _worst(results: Results) -> np.ndarray:
    """Failed trials, the earliest first; then those with the largest error. Invalid trials are left out."""
    of = lambda name: results.rows[name].values[results.ran]
    errors = of(results.tracking[0]) if results.tracking else np.inf
    error = np.where(results.lasted[results.ran], errors, np.inf)
    order = np.lexsort((of("ended"), -error))
    return of("trial")[order[:_WORST]]
