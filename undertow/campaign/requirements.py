"""Whether enough trials keep a requirement on a metric."""

import math
from typing import Any

import xarray as xr

from undertow.campaign.campaign_schema import Campaign, Requirement

_CONFIDENCE = 0.95


def verdict(rows: xr.Dataset, name: str, required: Requirement) -> dict[str, Any]:
    """Share of the trials that ran that keep a requirement, with the interval of Clopper and Pearson (1934).

    The interval is exact for random samples. Failed trials do not keep the requirement.
    """
    from scipy.stats import binomtest  # takes long to import, and few campaigns have requirements

    kept, count = int((rows[name].values < required.below).sum()), max(1, rows.sizes["trial"])
    interval = binomtest(kept, count).proportion_ci(_CONFIDENCE, method="exact")
    holds = "holds" if interval.low >= required.share else "fails" if interval.high < required.share else "open"
    return {
        "metric": name,
        "below": required.below,
        "share": required.share,
        "kept": kept / count,
        "interval": [float(interval.low), float(interval.high)],
        "verdict": holds,
    }


def enough(share: float) -> int:
    """Number of trials without a failure that demonstrates a share: the interval of n out of n starts there."""
    return math.ceil(math.log((1 - _CONFIDENCE) / 2) / math.log(share))


def too_few(campaign: Campaign) -> tuple[str, ...]:
    """A sentence for each requirement that the number of trials cannot demonstrate."""
    return tuple(
        f"`requirements.{name}.share` is {required.share:g}, which takes at least {enough(required.share)} trials "
        f"without a failure to demonstrate; `trials` is {campaign.trials}"
        for name, required in campaign.requirements.items()
        if campaign.trials < enough(required.share)
    )
