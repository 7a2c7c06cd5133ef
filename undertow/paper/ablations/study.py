"""Running the ablations by the campaign engine, and their rows in results.json."""

import itertools
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from undertow.core.atomic_io import write_whole
from undertow.core.status import Status
from undertow.paper import all_outputs
from undertow.paper.ablations.verdicts import Ablation
from undertow.scenario.part_cache import PartCache
from undertow.studies.campaign import task
from undertow.studies.campaign.build_trials import build_trial
from undertow.studies.campaign.campaign_schema import read_campaign, whole
from undertow.studies.campaign.campaign_summary import median_interval, quantiles
from undertow.studies.campaign.labels import words
from undertow.studies.campaign.trials import trials

QUICK_SEEDS = 8

_FOLDER = Path(__file__).parent


class Variant(NamedTuple):
    """One variant over the seeds, as in results.json."""

    settings: str  # how it differs from the scenario
    seeds: int
    failures: int  # runs that ended early
    metrics: Mapping[str, dict[str, float]]  # see `spread`

    def median(self, metric: str) -> float:
        """Median of a metric."""
        return self.metrics[metric]["median"]


def run(ablation: Ablation, quick: bool, folder: Path | None = None) -> dict[str, Any]:
    """One ablation as in results.json.

    Args:
        ablation: which one.
        quick: whether to run fewer seeds.
        folder: folder of `campaigns/`, from which it can be run again; None to write nothing.

    Raises:
        KeyError: the verdict needs a variant that the campaign does not have.
    """
    by_name: dict[str, Variant] = {}
    for name in ablation.campaigns:
        by_name |= dict(variants(_FOLDER / f"{name}.yaml", ablation.metrics, quick, folder))
    verdict = ablation.judge(by_name)
    return {
        "id": ablation.id,
        "question": read_campaign(_FOLDER / f"{ablation.campaigns[0]}.yaml")[0].description,
        "prediction": ablation.prediction,
        "agrees": verdict.agrees,
        "answer": verdict.text,
        "left_out": ablation.left_out,
        "campaigns": list(ablation.campaigns),
        "variants": [{"name": name, **variant._asdict()} for name, variant in by_name.items()],
    }


def trials_of(ablation: Ablation) -> int:
    """Number of trials of an ablation."""
    return sum(read_campaign(_FOLDER / f"{name}.yaml")[0].number for name in ablation.campaigns)


def variants(
    path: Path, metrics: tuple[str, ...], quick: bool, folder: Path | None = None
) -> Iterator[tuple[str, Variant]]:
    """Every combination of a campaign, by its name."""
    campaign, text = read_campaign(path)
    if quick:
        campaign = campaign.model_copy(update={"trials": QUICK_SEEDS})
    campaign_trials = trials(campaign, text)
    campaign_text = whole(campaign, campaign_trials.scenario.data)
    if folder is not None:
        (folder / "campaigns").mkdir(parents=True, exist_ok=True)
        write_whole(folder / "campaigns" / path.name, campaign_text)
    columns = task.run_trials(campaign_text, str(campaign_trials.scenario.folder), range(campaign_trials.number))
    if (columns["status"] == task.INVALID).any():
        build_trial(campaign_trials, PartCache(), int(np.argmax(columns["status"] == task.INVALID)))  # raises the error
    names = list(itertools.product(*campaign.axes.values()))
    for i, name in enumerate(names):
        of_variant = {key: values[i :: len(names)] for key, values in columns.items()}
        lasted = of_variant["status"] == int(Status.OK)
        of_variant |= all_outputs.of_columns(of_variant)
        uncertainty = of_variant["uncertainty_rms"]
        of_variant["share"] = of_variant["estimation_rms"] / np.where(uncertainty > 0, uncertainty, np.nan)
        defined = [metric for metric in metrics if not np.isnan(of_variant[metric][lasted]).all() or not lasted.any()]
        spreads = {metric: spread(np.where(lasted, of_variant[metric], np.inf)) for metric in defined}
        settings = ", ".join(f"{key}: {words(value)}" for key, value in campaign_trials.values(i).items())
        yield ", ".join(name), Variant(settings or "Table 1", lasted.size, int((~lasted).sum()), spreads)


def unit_of(metric: str) -> str:
    """Unit of a metric of an ablation; `share`, of the uncertainty that the estimate misses, has none."""
    return "" if metric == "share" else all_outputs.unit_of(metric)


def spread(values: np.ndarray) -> dict[str, float]:
    """Median of a metric over the seeds with its 95 % confidence interval, and the 5 % and 95 % quantiles.

    A run that ended early counts as infinite.
    """
    low, median, high = quantiles(values).values()
    median_low, median_high = median_interval(values)
    return {"median": median, "low": low, "high": high, "median_low": median_low, "median_high": median_high}
