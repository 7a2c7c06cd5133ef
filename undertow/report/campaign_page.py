"""The page of a campaign: endings, requirements, distributions, dependence, the worst trials, what was flown."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from undertow.campaign.store_results import Results
from undertow.report.campaign_tables import asked, by_choice, by_xla, distributions, endings, named, requirements, worst
from undertow.report.figures.campaign import distributions_figure, sensitivity_figure
from undertow.report.figures.writing import Drawings, Saved, save_all
from undertow.report.formats import prose
from undertow.report.page import Html, bullets, document, figure, section, tag

_CAPTIONS = {
    "distributions": "Every trial that was flown, one step each; a curve that ends below 1 lacks those that failed. "
    "The further left, the better. Metrics are of the steady window: the second half of a run, unless `steady` of the "
    "scenario says otherwise.",
    "sensitivity": "Spearman's rank correlation over the trials that lasted, mean over the combinations: +1 where a "
    "metric grows with a parameter, -1 where it falls, 0 where one says nothing about the other.",
}
_INTERVALS = (
    "Share of the trials that keep to it, with the interval of 95 % of Clopper and Pearson: exact for random draws; "
    "Latin and Sobol draws are more even than that, and the interval on the safe side. A trial that failed does not "
    "keep to it, one whose scenario cannot be built is not counted; `open`: more trials are needed, which larger "
    "`trials` and `--resume` add. The interval is meant for a number of trials that was fixed before anybody looked."
)


def write_campaign(title: str, results: Results, found: Mapping[str, Any], folder: Path) -> tuple[Path, list[str]]:
    """Write `campaign.html`, and every figure as SVG and PNG into `figures/`; what could not be drawn, in sentences.

    Args:
        title: of the page.
        results: the trials.
        found: their summary.
        folder: where.

    Raises:
        OSError: the folder cannot be written.
    """
    saved = save_all(lambda: _drawings(results, found), folder / "figures")
    drawn = _drawn(saved)
    page = document(
        title,
        tag("h1", prose(title)),
        tag("p", f"{found['done']} of {found['trials']} trials", class_="lead"),
        *(tag("p", prose(sentence)) for sentence in saved.failures),
        section("endings", "How they ended", *_endings(found)),
        *_optional("requirements", "Requirements", tag("p", prose(_INTERVALS)), requirements(found)),
        section("metrics", "Distributions", drawn["distributions"], distributions(results, found)),
        *_optional("dependence", "What they depend on", drawn["sensitivity"], *_choices(results, found)),
        section("worst", "The worst trials", _how(found), worst(results, found)),
        section("asked", "What was flown", *asked(results)),
    )
    path = folder / "campaign.html"
    path.write_text(page, encoding="utf-8")
    return path, saved.failures


def _endings(found: Mapping[str, Any]) -> list[Html]:
    ended = endings(found)
    if not found["refused"]:
        return [ended]
    said = [prose(f"{one['trials']} as here: {one['why']}") for one in found["refused"]]
    return [ended, tag("p", "Refused, and so not flown:"), bullets(said)]


def _choices(results: Results, found: Mapping[str, Any]) -> list[Html]:
    tables = by_choice(results, found)
    said = "By choice: median [5 %, 95 %] of the trials that lasted, all combinations together."
    return [tag("p", prose(said)), *tables] if tables else []


def _optional(identity: str, title: str, *content: Html) -> list[Html]:
    """A section, unless what it is about, the last of its content, is not there."""
    return [section(identity, title, *content)] if any(content[-1:]) else []


def _how(found: Mapping[str, Any]) -> Html:
    order = "Those that failed, the earliest first, then those with the largest tracking rms."
    again = "To fly one again, in the folder of this page: `undertow simulate worst/trial-NUMBER.yaml`."
    return tag("p", prose(f"{order} {again} {by_xla(found)}".rstrip()))


def _drawings(results: Results, found: Mapping[str, Any]) -> Drawings:
    """What makes each figure; nothing where there is nothing to draw."""
    values, units = _values(results, found), {metric: results.unit(metric) for metric in results.metrics}
    figures = {
        "distributions": (lambda: distributions_figure(values, _ran(found), units)) if values else None,
        "sensitivity": (lambda: sensitivity_figure(found["sensitivity"])) if found["sensitivity"] else None,
    }
    return {name: make for name, make in figures.items() if make is not None}


def _drawn(saved: Saved) -> dict[str, Html]:
    """Figures by name, for the page."""
    return dict.fromkeys(_CAPTIONS, Html("")) | {
        name: figure(vector.read_text(encoding="utf-8"), name, _CAPTIONS[name], prose(_CAPTIONS[name]))
        for name, vector in saved.vectors.items()
    }


def _ran(found: Mapping[str, Any]) -> dict[str, int]:
    return {named(one): one["trials"] - one["refused"] for one in found["combinations"]}


def _values(results: Results, found: Mapping[str, Any]) -> dict[str, dict[str, np.ndarray]]:
    """Finite values of each metric by combination."""
    values: dict[str, dict[str, np.ndarray]] = {}
    numbers = np.unique(results.combinations)
    for number, one in zip(numbers, found["combinations"], strict=True):
        rows = results.rows.isel(trial=results.combinations == number)
        for metric in one["metrics"]:
            whole = rows[metric].values
            if np.isfinite(whole).any():
                values.setdefault(metric, {})[named(one)] = whole[np.isfinite(whole)]
    return values
