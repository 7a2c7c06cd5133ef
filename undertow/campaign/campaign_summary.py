"""What the results of a campaign say: distributions, what they depend on, requirements, failures, the worst trials."""

from typing import Any

import numpy as np
import xarray as xr

from undertow.campaign.batch_runner import XLA
from undertow.campaign.columns import ENDINGS, JUDGEMENTS
from undertow.campaign.invalid_trials import refusals
from undertow.campaign.requirements import verdict
from undertow.campaign.sensitivity import by_choice, correlations, defined_quantiles
from undertow.campaign.store_results import Results
from undertow.campaign.trials import Trials

_WORST = 5


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
        "status": endings(results.rows),
        "by_xla": int((results.rows["backend"].values == XLA).sum()),
        "refused": [one._asdict() for one in refusals(several, refused)],
        "combinations": [_combination(results, number) for number in np.unique(results.combinations)],
        "sensitivity": correlations(results),
        "choices": by_choice(results),
        "worst": [int(trial) for trial in _worst(results)],
    }


def endings(rows: xr.Dataset) -> dict[str, int]:
    """How many trials ended how; empty before the first is done."""
    codes = rows["status"].values if "status" in rows else np.zeros(0)
    return {word: int((codes == code).sum()) for code, word in ENDINGS.items() if (codes == code).any()}


def _combination(results: Results, number: int) -> dict[str, Any]:
    """Distributions and requirements of one combination of `cross`."""
    own = results.combinations == number
    rows, lasted, flown = results.rows.isel(trial=own), results.lasted[own], results.flown[own]
    return {
        "values": dict(zip(results.campaign.axes, results.named(number), strict=True)),
        "trials": int(lasted.size),
        "status": endings(rows),
        "failed": int((flown & ~lasted).sum()),
        "refused": int((~flown).sum()),
        "metrics": defined_quantiles(rows, results.metrics, lasted),
        "success": {word: int((rows["success"].values == code).sum()) for code, word in JUDGEMENTS.items()},
        "requirements": [
            verdict(rows.isel(trial=flown), name, wanted) for name, wanted in results.campaign.requirements.items()
        ],
    }


def _worst(results: Results) -> np.ndarray:
    """Trials that failed, the earliest first; then those with the largest error. What was refused was not flown."""
    rows, lasted = results.rows.isel(trial=results.flown), results.lasted[results.flown]
    errors = rows[results.tracking[0]].values if results.tracking else np.inf
    error = np.where(lasted, errors, np.inf)
    order = np.lexsort((rows["ended"].values, -error))
    return rows["trial"].values[order[:_WORST]]
