"""The tables of the last chapter: every fidelity again, and the ablations."""

import math
from collections.abc import Mapping, Sequence
from typing import Any

from undertow.report.formats import ending, number, prose, unit
from undertow.report.page import Html, join, table, tag
from undertow.reproduction.all_outputs import unit_of

_FIDELITY = ("tracking_rms", "estimation_rms", "input_rms", "input_variation", "saturated_fraction")
_KINDS = {"yes": "holds", "partly": "partly", "no": "fails"}
_OWN_UNITS = {"share": "", "lost_axes": ""}


def fidelity(rows: Sequence[Mapping[str, Any]]) -> Html:
    """Every controller in every case, with the command that runs it."""
    shown, last = [], None
    for row in rows:
        steady = row["steady"] or {}
        place = tag("b", row["words"]) if row["words"] != last else ""
        last = row["words"]
        ended = tag("span", ending(dict(row)), class_=f"chip {'holds' if row['status'] == 'ok' else 'fails'}")
        name = join(row["name"], tag("div", tag("code", row["scenario"]), class_="small"))
        shown.append((place, name, ended, *(number(steady.get(metric)) for metric in _FIDELITY)))
    head = (
        "case",
        "controller",
        "status",
        *(join(metric.replace("_", " "), " ", _unit(metric)) for metric in _FIDELITY),
    )
    return table(head, shown, numeric=range(3, 3 + len(_FIDELITY)), wide=True)


def answers(ablations: Sequence[Mapping[str, Any]]) -> Html:
    """One row per ablation: question, prediction, whether it holds, and the answer with its numbers."""
    rows = []
    for one in ablations:
        said = tag("span", f"as predicted: {one['agrees']}", class_=f"chip {_KINDS[one['agrees']]}")
        left = tag("span", prose(f"left out: {one['left_out']}"), class_="said") if one["left_out"] else ""
        asked = join(prose(one["question"]), tag("span", prose(one["prediction"]), class_="said"))
        rows.append((tag("b", one["id"]), asked, said, join(prose(one["answer"]), left)))
    return table(("", "question, and prediction of the theory", "", "answer"), rows, wide=True)


def numbers(ablations: Sequence[Mapping[str, Any]]) -> Html:
    """Every variant of every ablation: settings, medians with intervals, runs that ended early."""
    rows = []
    for one in ablations:
        for place, variant in enumerate(one["variants"]):
            name = join(variant["name"], tag("span", variant["settings"], class_="said"))
            failed = variant["failures"]
            lost = f"{failed} of {variant['seeds']}" if failed else "0"
            cells = [_metric(metric, spread) for metric, spread in variant["metrics"].items()]
            cells += [Html("")] * (4 - len(cells))
            rows.append((tag("b", one["id"]) if place == 0 else "", name, lost, *cells[:4]))
    head = ("", "variant and its settings", "ended early", "median [95 % interval of the median]; 5 to 95 % of seeds")
    return table((*head, "", "", ""), rows, wide=True)


def _metric(name: str, spread: Mapping[str, float]) -> Html:
    title = tag("span", name.replace("_", " "), class_="unit")
    if not math.isfinite(spread["median"]):
        return join(title, Html("<br>"), "most ended early")
    middle = join(_number(spread["median"]), " [", _number(spread["median_low"]), ", ")
    middle = join(middle, _number(spread["median_high"]), "]")
    whole = tag("span", _number(spread["low"]), " to ", _number(spread["high"]), class_="said")
    return join(title, Html("<br>"), middle, whole)


def _number(value: float) -> Html:
    return number(value) if math.isfinite(value) else Html("&infin;")


def _unit(metric: str) -> Html:
    return unit(_OWN_UNITS[metric] if metric in _OWN_UNITS else unit_of(metric))
