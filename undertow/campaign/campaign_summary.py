"""Summary of a campaign: distributions, sensitivities, requirements, failures and the worst trials."""

from typing import Any

import numpy as np
import xarray as xr

from undertow.campaign.batch_runner import XLA
from undertow.campaign.columns import ENDINGS, JUDGEMENTS
from undertow.campaign.invalid_trials import reasons
from undertow.campaign.requirements import verdict
from undertow.campaign.sensitivity import by_choice, correlations, defined_quantiles
from undertow.campaign.store_results import Results
from undertow.campaign.trials import Trials

_WORST = 5


def summary(results: Results, several: Trials) -> dict[str, Any]:
    """The contents of summary.json.

    Args:
        results: results of the campaign.
        several: its trials, to find out why some were invalid.
    """
    invalid = results.rows["trial"].values[~results.ran]
    return {
        "trials": results.total,
        "done": results.rows.sizes["trial"],
        "status": endings(results.rows),
        "by_xla": int((results.rows["backend"].values == XLA).sum()),
        "invalid": [one._asdict() for one in reasons(several, invalid)],
        "combinations": [_combination(results, number) for number in np.unique(results.combinations)],
        "sensitivity": correlations(results),
        "choices": by_choice(results),
        "worst": [int(trial) for trial in _worst(results)],
    }


def endings(rows: xr.Dataset) -> dict[str, int]:
    """Number of trials by status; empty before the first is done."""
    codes = rows["status"].values if "status" in rows else np.zeros(0)
    return {word: int((codes == code).sum()) for code, word in ENDINGS.items() if (codes == code).any()}


def _combination(results: Results, number: int) -> dict[str, Any]:
    """Distributions and requirements of one combination of `cross`."""
    own = results.combinations == number
    rows, lasted, ran = results.rows.isel(trial=own), results.lasted[own], results.ran[own]
    return {
        "values": dict(zip(results.campaign.axes, results.named(number), strict=True)),
        "trials": int(lasted.size),
        "status": endings(rows),
        "failed": int((ran & ~lasted).sum()),
        "invalid": int((~ran).sum()),
        "metrics": defined_quantiles(rows, results.metrics, lasted),
        "success": {word: int((rows["success"].values == code).sum()) for code, word in JUDGEMENTS.items()},
        "requirements": [
            verdict(rows.isel(trial=ran), name, required) for name, required in results.campaign.requirements.items()
        ],
    }


def _worst(results: Results) -> np.ndarray:
    """Failed trials, the earliest first; then those with the largest error. Invalid trials are left out."""
    rows, lasted = results.rows.isel(trial=results.ran), results.lasted[results.ran]
    errors = rows[results.tracking[0]].values if results.tracking else np.inf
    error = np.where(lasted, errors, np.inf)
    order = np.lexsort((rows["ended"].values, -error))
    return rows["trial"].values[order[:_WORST]]
