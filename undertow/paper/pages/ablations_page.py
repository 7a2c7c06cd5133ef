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


def ablations_page(results: Mapping[str, Any], overview: Html, report: str) -> str:
    """The whole page.

    Args:
        results: `robust_variant` of results.json.
        overview: the figure of all ablations; empty where there is none.
        report: name of the page that it belongs to.
    """
    ablations = results["ablations"]
    back = tag("nav", tag("a", "Report: reproduction of the paper and check of its claims", href=report))
    return document(
        TITLE,
        tag("h1", TITLE),
        back,
        tag("p", prose(_how(results)), class_="lead"),
        section("verdicts", "Verdicts", tag("p", prose(_COLOURS)), answers_table(ablations), overview),
        *(_ablation(ablation) for ablation in ablations),
    )


def _how(results: Mapping[str, Any]) -> str:
    text = (
        f"One element is changed at a time. Disturbances, noise and failures are random, with {results['seeds']} seeds "
        "that are the same for every variant; gains were tuned on other seeds. Statistics are those of the second half "
        "of each run. A run that ended early counts as infinite."
    )
    return f"{text}{left_out(results)}"


def left_out(results: Mapping[str, Any]) -> str:
    """A sentence on what a quick report lacks; empty otherwise."""
    if not results["left_out"]:
        return ""
    return f" This quick report uses fewer seeds and leaves out {', '.join(results['left_out'])}."


def verdict(ablation: Ablation) -> Html:
    """Whether the prediction of the theory holds, coloured."""
    return tag("span", f"as predicted: {ablation['agrees']}", class_=f"chip {_KINDS[ablation['agrees']]}")


def answers_table(ablations: Sequence[Ablation], page: str = "") -> Html:
    """One row per ablation: question, whether the theory predicted the answer, and a link to its section on a page."""
    rows = [
        (tag("a", ablation["id"], href=f"{page}#{ablation['id']}"), prose(ablation["question"]), verdict(ablation))
        for ablation in ablations
    ]
    return table(("", "question", "verdict"), rows)


def _ablation(ablation: Ablation) -> Html:
    files = [f"{name}.yaml" for name in ablation["campaigns"]]
    commands = [f"undertow campaign campaigns/{file} --out {file.removesuffix('.yaml')}" for file in files]
    file_names = " and ".join(f"`undertow/paper/ablations/{file}`" for file in files)
    return section(
        ablation["id"],
        f"{ablation['id']}: {ablation['question']}",
        tag("p", "Prediction of the theory: ", prose(ablation["prediction"])),
        tag("p", verdict(ablation), " ", prose(ablation["answer"])),
        *([tag("p", prose(f"Not examined: {ablation['left_out']}."))] if ablation["left_out"] else []),
        tag("p", prose(f"Campaign file: {file_names}. To run it alone, in the folder of this page:")),
        *(tag("pre", command) for command in commands),
        numbers_table(ablation),
    )


def numbers_table(ablation: Ablation) -> Html:
    """Every variant: settings, medians with intervals, runs that ended early."""
    metrics = list(dict.fromkeys(name for variant in ablation["variants"] for name in variant["metrics"]))
    rows = []
    for variant in ablation["variants"]:
        name = join(variant["name"], tag("span", variant["settings"], class_="said"))
        failed = f"{variant['failures']} of {variant['seeds']}" if variant["failures"] else "0"
        rows.append((name, failed, *(_spread(variant["metrics"].get(metric)) for metric in metrics)))
    heads = (join(metric.replace("_", " "), " ", unit(unit_of(metric))) for metric in metrics)
    sentence = "Median [95 % interval of the median], and below it the 5 % to 95 % range of the seeds."
    statistics = table(
        ("variant and its settings", "ended early", *heads), rows, numeric=range(2, 2 + len(metrics)), wide=True
    )
    return join(tag("p", sentence, class_="small"), statistics)


def _spread(spread: Mapping[str, float] | None) -> Html:
    if spread is None:
        return number(None)
    if not math.isfinite(spread["median"]):
        return Html("most ended early")
    middle = join(_number(spread["median"]), " [", _number(spread["median_low"]), ", ")
    seed_range = tag("span", _number(spread["low"]), " to ", _number(spread["high"]), class_="said")
    return join(middle, _number(spread["median_high"]), "]", seed_range)


def _number(value: float) -> Html:
    return number(value) if math.isfinite(value) else Html("&infin;")
