"""Whether enough trials keep to what is required of a metric."""

import math
from typing import Any

import xarray as xr
from scipy.stats import binomtest

from undertow.campaign.campaign_schema import Campaign, Requirement

_CONFIDENCE = 0.95


def verdict(rows: xr.Dataset, name: str, wanted: Requirement) -> dict[str, Any]:
    """Share of the trials that keep to it, with the interval of Clopper and Pearson (1934), exact for random draws.

    Trials that failed do not keep to it.

    Args:
        rows: of the trials that were flown.
        name: of the metric.
        wanted: of it.
    """
    kept, count = int((rows[name].values < wanted.below).sum()), max(1, rows.sizes["trial"])
    interval = binomtest(kept, count).proportion_ci(_CONFIDENCE, method="exact")
    holds = "holds" if interval.low >= wanted.share else "fails" if interval.high < wanted.share else "open"
    return {
        "metric": name,
        "below": wanted.below,
        "share": wanted.share,
        "kept": kept / count,
        "interval": [float(interval.low), float(interval.high)],
        "verdict": holds,
    }


def enough(share: float) -> int:
    """Trials of which all must keep to it for a share to be shown: the interval of n out of n starts there."""
    return math.ceil(math.log((1 - _CONFIDENCE) / 2) / math.log(share))


def too_few(campaign: Campaign) -> tuple[str, ...]:
    """A sentence for each requirement that so few trials cannot show to hold."""
    return tuple(
        f"`requirements.{name}.share` is {wanted.share:g}: {campaign.trials} trials cannot show it even if all keep to "
        f"it; {enough(wanted.share)} can"
        for name, wanted in campaign.requirements.items()
        if campaign.trials < enough(wanted.share)
    )
