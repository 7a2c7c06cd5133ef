"""What the results of a campaign say: distributions, what they depend on, requirements, failures, the worst trials."""

from typing import Any

import numpy as np
import xarray as xr
from scipy.stats import binomtest

from undertow.studies.campaign.columns import ENDINGS
from undertow.studies.campaign.dependence import by_choice, correlations, quantiles
from undertow.studies.campaign.refusals import refusals
from undertow.studies.campaign.results import Results
from undertow.studies.campaign.trials import Trials

_WORST = 5
_CONFIDENCE = 0.95

# Trials are ranked by this; those that failed come first.
_RANKED_BY = "tracking_rms"


def summary(results: Results, several: Trials) -> dict[str, Any]:
    """Everything that stands in summary.json.

    Args:
        results: of the campaign.
        several: its trials, to say why some were refused.
    """
    refused = results.rows["trial"].values[~results.flown]
    return {
        "trials": results.total,
        "done": results.rows.sizes["trial"],
        "status": endings(results),
        "refused": [one._asdict() for one in refusals(several, refused)],
        "combinations": [_combination(results, number) for number in np.unique(results.combinations)],
        "sensitivity": correlations(results),
        "choices": by_choice(results),
        "worst": [int(trial) for trial in _worst(results)],
    }


def endings(results: Results) -> dict[str, int]:
    """How many trials ended how; empty before the first is done."""
    codes = results.rows["status"].values if "status" in results.rows else np.zeros(0)
    return {ENDINGS[int(code)]: int((codes == code).sum()) for code in np.unique(codes)}


def _combination(results: Results, number: int) -> dict[str, Any]:
    """Distributions and requirements of one combination of `cross`."""
    own = results.combinations == number
    rows, lasted, flown = results.rows.isel(trial=own), results.lasted[own], results.flown[own]
    return {
        "values": dict(zip(results.campaign.cross, results.named(number), strict=True)),
        "trials": int(lasted.size),
        "failed": int((flown & ~lasted).sum()),
        "refused": int((~flown).sum()),
        "metrics": {name: quantiles(rows[name].values[lasted]) for name in results.metrics} if lasted.any() else {},
        "requirements": [
            _requirement(rows.isel(trial=flown), name, one) for name, one in results.campaign.requirements.items()
        ],
    }


def _requirement(rows: xr.Dataset, name: str, wanted: Any) -> dict[str, Any]:
    """Whether enough trials keep to it, with the interval of Clopper and Pearson (1934), exact for random draws.

    Trials that failed do not keep to it.
    """
    kept, count = int((rows[name].values < wanted.below).sum()), max(1, rows.sizes["trial"])
    interval = binomtest(kept, count).proportion_ci(_CONFIDENCE, method="exact")
    verdict = "holds" if interval.low >= wanted.share else "fails" if interval.high < wanted.share else "open"
    return {
        "metric": name,
        "below": wanted.below,
        "share": wanted.share,
        "kept": kept / count,
        "interval": [float(interval.low), float(interval.high)],
        "verdict": verdict,
    }


def _worst(results: Results) -> np.ndarray:
    """Trials that failed, the earliest first; then those with the largest error. What was refused was not flown."""
    rows, lasted = results.rows.isel(trial=results.flown), results.lasted[results.flown]
    error = np.where(lasted, rows[_RANKED_BY].values, np.inf)
    order = np.lexsort((rows["ended"].values, -error))
    return rows["trial"].values[order[:_WORST]]
