"""The page of a campaign: distributions, requirements, what the metrics depend on, failures, the worst trials."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from undertow.analysis.meanings import MEANINGS
from undertow.report.figures.campaign import distributions_figure, sensitivity_figure
from undertow.report.figures.writing import save
from undertow.report.formats import prose, unit
from undertow.report.page import Html, document, figure, join, section, table, tag
from undertow.studies.campaign.summary import Results

_CAPTIONS = {
    "distributions": "Every trial that lasted, one step each. The further left, the better.",
    "sensitivity": "Spearman's rank correlation over the trials that lasted, mean over the combinations: +1 where a "
    "metric grows with a parameter, -1 where it falls, 0 where one says nothing about the other.",
}


def write_campaign(title: str, results: Results, found: Mapping[str, Any], folder: Path) -> Path:
    """Write `campaign.html`, and every figure as SVG and PNG into `figures/`.

    Args:
        title: of the page.
        results: the trials.
        found: their summary.
        folder: where.

    Raises:
        OSError: the folder cannot be written.
    """
    page = document(
        title,
        tag("h1", prose(title)),
        tag("p", f"{found['done']} of {found['trials']} trials", class_="lead"),
        section("endings", "How they ended", table(("", "trials"), list(found["status"].items()), numeric=(1,))),
        *_requirements(found),
        section("metrics", "Distributions", *_drawn(results, found, folder), _quantiles(found)),
        section("worst", "The worst trials", _worst(results, found)),
    )
    path = folder / "campaign.html"
    path.write_text(page, encoding="utf-8")
    return path


def _drawn(results: Results, found: Mapping[str, Any], folder: Path) -> list[Html]:
    values = _values(results, found)
    figures = {"distributions": distributions_figure(values)} if values else {}
    if found["sensitivity"]:
        figures["sensitivity"] = sensitivity_figure(found["sensitivity"])
    drawn = []
    for name, one in figures.items():
        vector, _ = save(one, folder / "figures", name)
        drawn.append(figure(vector.read_text(encoding="utf-8"), name, _CAPTIONS[name], _CAPTIONS[name]))
    return drawn


def _values(results: Results, found: Mapping[str, Any]) -> dict[str, dict[str, np.ndarray]]:
    """Finite values of each metric by combination."""
    values: dict[str, dict[str, np.ndarray]] = {}
    numbers = np.unique(results.combinations)
    for number, one in zip(numbers, found["combinations"], strict=True):
        rows = results.rows.isel(trial=results.combinations == number)
        for metric in one["metrics"]:
            whole = rows[metric].values
            values.setdefault(metric, {})[_name(one)] = whole[np.isfinite(whole)]
    return values


def _name(combination: Mapping[str, Any]) -> str:
    return ", ".join(str(value) for value in combination["values"].values()) or "all trials"


def _requirements(found: Mapping[str, Any]) -> list[Html]:
    rows = []
    for one in found["combinations"]:
        for wanted in one["requirements"]:
            chip = {"holds": "holds", "fails": "fails"}.get(wanted["verdict"], "partly")
            low, high = wanted["interval"]
            asked = f"{wanted['metric']} < {wanted['below']:g} in {wanted['share']:.0%}"
            share = f"{wanted['kept']:.1%} [{low:.1%}, {high:.1%}]"
            rows.append((asked, _name(one), share, tag("span", wanted["verdict"], class_=f"chip {chip}")))
    if not rows:
        return []
    said = "Share of the trials that keep to it, with the exact interval of 95 % (Clopper and Pearson). A trial that "
    said += (
        "failed does not keep to it, one whose scenario cannot be built is not counted; `open`: more trials are needed."
    )
    head = ("required", "of", "share", "verdict")
    return [section("requirements", "Requirements", tag("p", prose(said)), table(head, rows, wide=True))]


def _quantiles(found: Mapping[str, Any]) -> Html:
    rows = []
    for one in found["combinations"]:
        for metric, quantiles in one["metrics"].items():
            named = join(metric.replace("_", " "), " ", unit(MEANINGS[metric].unit))
            rows.append((named, _name(one), *(f"{value:.4g}" for value in quantiles.values())))
    return table(("metric", "of", "5 %", "median", "95 %"), rows, numeric=(2, 3, 4), wide=True)


def _worst(results: Results, found: Mapping[str, Any]) -> Html:
    rows = []
    for trial in found["worst"]:
        row = results.rows.sel(trial=trial)
        command = tag("code", f"undertow simulate worst/trial-{trial:07d}.yaml")
        rows.append((str(trial), f"{float(row['tracking_rms']):.4g}", f"{float(row['ended']):.4g}", command))
    return table(("trial", "tracking rms", "ended, s", "fly it again"), rows, numeric=(1, 2), wide=True)
