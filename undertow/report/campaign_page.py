"""The page of a campaign: status, requirements, distributions, sensitivities, the worst trials, the configuration."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from undertow.campaign.store_results import Results
from undertow.report.campaign_tables import asked, by_choice, by_xla, distributions, endings, named, requirements, worst
from undertow.report.figures.campaign import distributions_figure, sensitivity_figure
from undertow.report.figures.writing import Plots, Saved, save_all
from undertow.report.formats import prose
from undertow.report.page import Html, bullets, document, figure, section, tag

_CAPTIONS = {
    "distributions": "Empirical cumulative distribution functions, with one step per trial. A curve that ends below 1 "
    "has failed trials. Smaller values are better. Metrics are computed over the steady window: the second half of a "
    "run, unless `steady` of the scenario says otherwise.",
    "sensitivity": "Spearman's rank correlation over the completed trials, mean over the combinations: +1 where a "
    "metric increases with a parameter, -1 where it decreases, 0 where they are unrelated.",
}
_INTERVALS = (
    "Share of the trials that keep each requirement, with its 95 % Clopper-Pearson interval. The interval is exact for "
    "random samples and conservative for Latin hypercube and Sobol samples, which are more even. A failed trial does "
    "not keep the requirement; an invalid trial is not counted. The verdict `open` means that more trials are needed: "
    "increase `trials` and use `--resume`. The interval assumes that the number of trials was fixed beforehand."
)


def write_campaign(title: str, results: Results, found: Mapping[str, Any], folder: Path) -> tuple[Path, list[str]]:
    """Write `campaign.html`, and every figure as SVG and PNG into `figures/`; return a sentence for each failed figure.

    Args:
        title: title of the page.
        results: the trials.
        found: their summary.
        folder: the results folder.

    Raises:
        OSError: the folder cannot be written.
    """
    saved = save_all(lambda: _plots(results, found), folder / "figures")
    plotted = _figures(saved)
    page = document(
        title,
        tag("h1", prose(title)),
        tag("p", f"{found['done']} of {found['trials']} trials", class_="lead"),
        *(tag("p", prose(sentence)) for sentence in saved.failures),
        section("status", "Status of the trials", *_endings(found)),
        *_optional("requirements", "Requirements", tag("p", prose(_INTERVALS)), requirements(found)),
        section("metrics", "Distributions", plotted["distributions"], distributions(results, found)),
        *_optional("sensitivity", "Sensitivity", plotted["sensitivity"], *_choices(results, found)),
        section("worst", "The worst trials", _how(found), worst(results, found)),
        section("configuration", "Configuration", *asked(results)),
    )
    path = folder / "campaign.html"
    path.write_text(page, encoding="utf-8")
    return path, saved.failures


def _endings(found: Mapping[str, Any]) -> list[Html]:
    ended = endings(found)
    if not found["invalid"]:
        return [ended]
    errors = [prose(f"{one['trials']} with this error: {one['why']}") for one in found["invalid"]]
    return [ended, tag("p", "The following trials are invalid and did not run:"), bullets(errors)]


def _choices(results: Results, found: Mapping[str, Any]) -> list[Html]:
    tables = by_choice(results, found)
    sentence = "Median [5 %, 95 %] of the completed trials for each choice, over all combinations."
    return [tag("p", prose(sentence)), *tables] if tables else []


def _optional(identity: str, title: str, *content: Html) -> list[Html]:
    """A section, unless the last part of its content is empty."""
    return [section(identity, title, *content)] if any(content[-1:]) else []


def _how(found: Mapping[str, Any]) -> Html:
    order = "Failed trials come first, the earliest at the top, then those with the largest tracking rms."
    again = "To repeat one, run `undertow simulate worst/trial-NUMBER.yaml` in the folder of this page."
    return tag("p", prose(f"{order} {again} {by_xla(found)}".rstrip()))


def _plots(results: Results, found: Mapping[str, Any]) -> Plots:
    """What makes each figure; nothing where there is nothing to sample."""
    values, units = _values(results, found), {metric: results.unit(metric) for metric in results.metrics}
    figures = {
        "distributions": (lambda: distributions_figure(values, _ran(found), units)) if values else None,
        "sensitivity": (lambda: sensitivity_figure(found["sensitivity"])) if found["sensitivity"] else None,
    }
    return {name: make for name, make in figures.items() if make is not None}


def _figures(saved: Saved) -> dict[str, Html]:
    """Figures by name, for the page."""
    return dict.fromkeys(_CAPTIONS, Html("")) | {
        name: figure(vector.read_text(encoding="utf-8"), name, _CAPTIONS[name], prose(_CAPTIONS[name]))
        for name, vector in saved.vectors.items()
    }


def _ran(found: Mapping[str, Any]) -> dict[str, int]:
    return {named(one): one["trials"] - one["invalid"] for one in found["combinations"]}


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
