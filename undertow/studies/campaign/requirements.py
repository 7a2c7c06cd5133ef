"""Requirements of a campaign: temporal formulas of every trial, and whether enough trials keep a requirement."""

import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import xarray as xr

from undertow.analysis.temporal import requirements as temporal
from undertow.core.errors import BadInput, error_location
from undertow.core.metric import Metric
from undertow.scenario.build import Built
from undertow.scenario.consistency import record_period
from undertow.studies.campaign.campaign_schema import Campaign, CampaignRequirement, RecordedSignals

_CONFIDENCE = 0.95


def formulas_of(campaign: Campaign, built: Built) -> tuple[temporal.Requirement, ...]:
    """The temporal formulas of a campaign, about one of its trials.

    Raises:
        BadInput: a text is no formula, or names what is no signal of the trial.
    """
    if not campaign.formulas:
        return ()
    with error_location("requirements"):
        loop = built.closed_loop
        duration = built.scenario.loop.duration
        return temporal.requirements_of(campaign.formulas, {}, loop, {}, duration)


def check_formulas(campaign: Campaign, built: Built) -> None:
    """Check the temporal formulas of a campaign, and that one array can hold the records that they need.

    Raises:
        BadInput: they are none, or the records differ from trial to trial.
    """
    formulas_of(campaign, built)
    for name in campaign.formulas:
        if name in built.known_metrics():
            raise BadInput(f"requirements.{name}", "have another name than a metric", "a formula")
    if not campaign.formulas:
        return
    for key in campaign.keys:
        if key in ("loop", "loop.dt", "loop.duration", "loop.record"):
            raise BadInput("requirements", "have formulas about runs of one length and one rate", f"varied {key}")
    every = built.scenario.loop.record
    if campaign.series is not None and campaign.series.every != every:
        must = f"be the time between records ({every:g} s), at which formulas are evaluated"
        raise BadInput("series.every", must, f"{campaign.series.every:g} s")


def recorded(campaign: Campaign, built: Built) -> RecordedSignals | None:
    """Series that a trial records: those that were asked for, and those that formulas need."""
    needed = temporal.needed_signals(formulas_of(campaign, built))
    if not needed:
        return campaign.series
    signals = campaign.series.signals if campaign.series is not None else []
    return RecordedSignals(signals=list(dict.fromkeys([*signals, *needed])), every=built.scenario.loop.record)


def formula_metrics(campaign: Campaign) -> dict[str, Metric]:
    """Metrics that hold the robustness of the formulas, by name."""
    meaning = "robustness of the requirement `{}`: signed distance to its violation, as a share of the bound"
    return {name: Metric("", meaning.format(text)) for name, text in campaign.formulas.items()}


def robustness(
    campaign: Campaign, built: Sequence[Built], series: Mapping[str, np.ndarray], status: np.ndarray, ended: np.ndarray
) -> dict[str, np.ndarray]:
    """Robustness of every formula in every trial.

    Args:
        campaign: with the formulas.
        built: each trial, or one of the same kind.
        series, status, ended: results of the trials.
    """
    by_name = {name: np.full(len(built), np.nan) for name in campaign.formulas}
    if not by_name:
        return by_name
    required: dict[int, tuple[temporal.Requirement, ...]] = {}
    for row, trial in enumerate(built):
        if id(trial) not in required:
            required[id(trial)] = formulas_of(campaign, trial)
        requirements = required[id(trial)]
        loop = trial.scenario.loop
        needed = temporal.needed_signals(requirements)
        signals = temporal.contiguous({name: series[name][row] for name in needed}, needed)
        ending = (int(status[row]), float(ended[row]), loop.duration)
        for name, verdict in temporal.evaluate_requirements(
            requirements, signals, record_period(loop), {}, *ending
        ).items():
            by_name[name][row] = verdict.robustness
    return by_name


def verdict(rows: xr.Dataset, name: str, required: CampaignRequirement) -> dict[str, Any]:
    """Share of the trials that ran that keep a requirement, with the interval of Clopper and Pearson (1934).

    A formula is kept where its robustness is positive. The interval is exact for random samples. Failed trials do not
    keep the requirement.
    """
    from scipy.stats import binomtest  # takes long to import, and few campaigns have requirements

    values = rows[name].values
    keeps = values > 0 if required.below is None else values < required.below
    passed = int(keeps.sum())
    count = max(1, rows.sizes["trial"])
    interval = binomtest(passed, count).proportion_ci(_CONFIDENCE, method="exact")
    holds = "holds" if interval.low >= required.share else "fails" if interval.high < required.share else "open"
    return {
        "metric": name,
        "below": required.below,
        "formula": required.formula,
        "share": required.share,
        "kept": passed / count,
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
