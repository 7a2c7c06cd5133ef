"""The ablations of the report, a page of their own: each with its question, verdict, campaign file and numbers."""

import math
from collections.abc import Mapping, Sequence
from typing import Any

from undertow.paper.ablations.study import unit_of
from undertow.report.formats import number, prose, unit
from undertow.report.page import Html, document, join, section, table, tag

NAME = "ablations.html"
TITLE = "Ablations of the paper's controller"

CAPTION = (
    "Dots are medians, thick lines the 95 % interval of the median, thin lines the 5 % to 95 % range of the seeds. "
    "A cross marks runs that ended early; where most runs ended early, there is no dot."
)

_KINDS = {"yes": "holds", "partly": "partly", "no": "fails"}
_COLOURS = (
    "Green: the numbers agree with the prediction of the theory. Amber: they agree in part. Red: they do not. The "
    "limits of each comparison are in `undertow/paper/ablations/verdicts.py`."
)

Ablation = Mapping[str, Any]


def ablations_page(found: Mapping[str, Any], overview: Html, report: str) -> str:
    """The whole page.

    Args:
        found: `robust_variant` of results.json.
        overview: the figure of all ablations; empty where there is none.
        report: name of the page that it belongs to.
    """
    ablations = found["ablations"]
    back = tag("nav", tag("a", "Report: reproduction of the paper and check of its claims", href=report))
    return document(
        TITLE,
        tag("h1", TITLE),
        back,
        tag("p", prose(_how(found)), class_="lead"),
        section("verdicts", "Verdicts", tag("p", prose(_COLOURS)), answers_table(ablations), overview),
        *(_ablation(one) for one in ablations),
    )


def _how(found: Mapping[str, Any]) -> str:
    text = (
        f"One element is changed at a time. Disturbances, noise and failures are random, with {found['seeds']} seeds "
        "that are the same for every variant; gains were tuned on other seeds. Statistics are those of the second half "
        "of each run. A run that ended early counts as infinite."
    )
    return f"{text}{left_out(found)}"


def left_out(found: Mapping[str, Any]) -> str:
    """A sentence on what a quick report lacks; empty otherwise."""
    if not found["left_out"]:
        return ""
    return f" This quick report uses fewer seeds and leaves out {', '.join(found['left_out'])}."


def verdict(one: Ablation) -> Html:
    """Whether the prediction of the theory holds, coloured."""
    return tag("span", f"as predicted: {one['agrees']}", class_=f"chip {_KINDS[one['agrees']]}")


def answers_table(ablations: Sequence[Ablation], page: str = "") -> Html:
    """One row per ablation: question, whether the theory predicted the answer, and a link to its section on a page."""
    rows = [
        (tag("a", one["id"], href=f"{page}#{one['id']}"), prose(one["question"]), verdict(one)) for one in ablations
    ]
    return table(("", "question", "verdict"), rows)


def _ablation(one: Ablation) -> Html:
    files = [f"{name}.yaml" for name in one["campaigns"]]
    commands = [f"undertow campaign campaigns/{file} --out {file.removesuffix('.yaml')}" for file in files]
    where = " and ".join(f"`undertow/paper/ablations/{file}`" for file in files)
    return section(
        one["id"],
        f"{one['id']}: {one['question']}",
        tag("p", "Prediction of the theory: ", prose(one["prediction"])),
        tag("p", verdict(one), " ", prose(one["answer"])),
        *([tag("p", prose(f"Not examined: {one['left_out']}."))] if one["left_out"] else []),
        tag("p", prose(f"Campaign file: {where}. To run it alone, in the folder of this page:")),
        *(tag("pre", command) for command in commands),
        numbers_table(one),
    )


def numbers_table(one: Ablation) -> Html:
    """Every variant: settings, medians with intervals, runs that ended early."""
    metrics = list(dict.fromkeys(name for variant in one["variants"] for name in variant["metrics"]))
    rows = []
    for variant in one["variants"]:
        name = join(variant["name"], tag("span", variant["settings"], class_="said"))
        failed = f"{variant['failures']} of {variant['seeds']}" if variant["failures"] else "0"
        rows.append((name, failed, *(_spread(variant["metrics"].get(metric)) for metric in metrics)))
    heads = (join(metric.replace("_", " "), " ", unit(unit_of(metric))) for metric in metrics)
    sentence = "Median [95 % interval of the median], and below it the 5 % to 95 % range of the seeds."
    whole = table(
        ("variant and its settings", "ended early", *heads), rows, numeric=range(2, 2 + len(metrics)), wide=True
    )
    return join(tag("p", sentence, class_="small"), whole)


def _spread(spread: Mapping[str, float] | None) -> Html:
    if spread is None:
        return number(None)
    if not math.isfinite(spread["median"]):
        return Html("most ended early")
    middle = join(_number(spread["median"]), " [", _number(spread["median_low"]), ", ")
    whole = tag("span", _number(spread["low"]), " to ", _number(spread["high"]), class_="said")
    return join(middle, _number(spread["median_high"]), "]", whole)


def _number(value: float) -> Html:
    return number(value) if math.isfinite(value) else Html("&infin;")
