"""What the results of a campaign say: distributions, what they depend on, requirements, failures, the worst trials."""

import itertools
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import xarray as xr
from scipy.stats import binomtest, spearmanr

from undertow.analysis.meanings import MEANINGS
from undertow.core.status import Status
from undertow.studies.campaign.conduct import STORE
from undertow.studies.campaign.reading import read_text
from undertow.studies.campaign.schema import Campaign
from undertow.studies.campaign.task import REFUSED

_QUANTILES = (0.05, 0.5, 0.95)
_WORST = 5
_CONFIDENCE = 0.95

# Trials are ranked by this; those that failed come first.
_RANKED_BY = "tracking_rms"


class Results(NamedTuple):
    """A campaign's rows, and what they were asked for."""

    campaign: Campaign
    rows: xr.Dataset  # of the tasks that are done
    total: int

    @property
    def metrics(self) -> list[str]:
        """Names, in the order of tables."""
        return [name for name in MEANINGS if name in self.rows]

    @property
    def combinations(self) -> np.ndarray:
        """Which combination of `cross` each row belongs to."""
        return self.rows["trial"].values // self.campaign.trials

    def named(self, combination: int) -> tuple[str, ...]:
        """Names of the values of `cross` in a combination."""
        return list(itertools.product(*self.campaign.cross.values()))[combination]


def load(folder: Path) -> Results:
    """The results in the folder of a campaign.

    Raises:
        FileNotFoundError: there are none.
        OSError: they are damaged.
    """
    whole = xr.open_zarr(folder / STORE, consolidated=False, chunks=None)
    whole = whole.drop_vars([name for name in whole if str(name).startswith("series:")])
    done, chunk = whole["done"].values.astype(bool), int(whole.attrs["chunk"])
    total = whole.sizes.get("trial", 0)
    rows = whole.drop_vars("done").assign_coords(trial=np.arange(total)).isel(trial=np.repeat(done, chunk)[:total])
    try:
        rows = rows.load()
    except RuntimeError as error:  # zarr's word for a chunk that is not what was written
        raise OSError(f"{folder / STORE} is damaged ({error}); `undertow campaign --resume` flies it again") from error
    return Results(read_text(whole.attrs["campaign"]), rows, total)


def summary(results: Results) -> dict[str, Any]:
    """Everything that stands in summary.json."""
    return {
        "trials": results.total,
        "done": results.rows.sizes["trial"],
        "status": endings(results),
        "combinations": [_combination(results, number) for number in np.unique(results.combinations)],
        "sensitivity": _sensitivity(results),
        "worst": [int(trial) for trial in _worst(results)],
    }


def endings(results: Results) -> dict[str, int]:
    """How many trials ended how; empty before the first is done."""
    codes = results.rows["status"].values if "status" in results.rows else np.zeros(0)
    return {_word(code): int((codes == code).sum()) for code in np.unique(codes)}


def _word(code: int) -> str:
    return "refused" if code == REFUSED else Status(int(code)).word


def _combination(results: Results, number: int) -> dict[str, Any]:
    """Distributions and requirements of one combination of `cross`."""
    rows = results.rows.isel(trial=results.combinations == number)
    lasted = rows["status"].values == int(Status.OK)
    quantiles = lambda values: dict(zip(map(str, _QUANTILES), np.quantile(values, _QUANTILES).tolist(), strict=True))
    return {
        "values": dict(zip(results.campaign.cross, results.named(number), strict=True)),
        "trials": int(lasted.size),
        "failed": int((~lasted).sum()),
        "metrics": {name: quantiles(rows[name].values[lasted]) for name in results.metrics} if lasted.any() else {},
        "requirements": [_requirement(rows, name, one) for name, one in results.campaign.requirements.items()],
    }


def _requirement(rows: xr.Dataset, name: str, wanted: Any) -> dict[str, Any]:
    """Whether enough trials keep to it, with the exact interval of Clopper and Pearson (1934).

    Trials that failed do not keep to it; those that were refused do not count.
    """
    kept = int((rows[name].values < wanted.below).sum())
    count = max(1, int((rows["status"].values != REFUSED).sum()))
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


def _sensitivity(results: Results) -> dict[str, dict[str, float]]:
    """Rank correlation (Spearman) of every metric with every number that is drawn: mean over the combinations."""
    found: dict[str, dict[str, float]] = {}
    lasted = results.rows["status"].values == int(Status.OK)
    groups = [lasted & (results.combinations == number) for number in np.unique(results.combinations)]
    for key in results.campaign.vary:
        column = results.rows[f"vary:{key}"]
        if "choices" in column.attrs:
            continue
        for name in results.metrics:
            pairs = [(column.values[group], results.rows[name].values[group]) for group in groups]
            known = [
                float(spearmanr(*pair)[0]) for pair in pairs if all(len(one) > 2 and np.ptp(one) > 0 for one in pair)
            ]
            if known:
                found.setdefault(key, {})[name] = sum(known) / len(known)
    return found


def _worst(results: Results) -> np.ndarray:
    """Trials that failed, the earliest first; then those with the largest error. What was refused was not flown."""
    rows = results.rows.isel(trial=results.rows["status"].values != REFUSED)
    failed = rows["status"].values != int(Status.OK)
    error = np.where(failed, np.inf, rows[_RANKED_BY].values)
    order = np.lexsort((rows["ended"].values, -error))
    return rows["trial"].values[order[:_WORST]]
