"""The last chapter of the report: the robust variant beside the paper's law."""

import math
from collections.abc import Mapping, Sequence
from typing import Any

from undertow.report.formats import ending, number, prose, unit
from undertow.report.page import Html, bullets, join, table, tag
from undertow.reproduction.all_outputs import unit_of

TITLE = "The robust variant"

CAPTIONS = {
    "robust_fidelity": (
        "The upper panels show the size of the tracking error against time, the lower panel its rms over the second "
        "half of each run. All runs are sampled, at 1 kHz on ODIN and at 100 Hz on BlueROV2 Heavy. A cross marks a run "
        "that ended early."
    ),
    "ablations": (
        "Dots are medians, thick lines the 95 % interval of the median, thin lines the 5 % to 95 % range of the seeds. "
        "A cross marks runs that ended early; where most runs ended early, there is no dot."
    ),
}

_LISTS = {
    "wins": "Advantages of the paper's approach",
    "same": "Cases in which a linear observer performs as well: axes without a motor, 20 s at most",
    "loses": "Disadvantages of the paper's approach",
    "neither": "Cases in which the robust variant is no better, or has a cost",
}


def robust_section(results: Mapping[str, Any], figures: Mapping[str, Html]) -> list[Html]:
    """Conclusions first, then every fidelity, then the ablations; nothing if the chapter was not run.

    Args:
        results: `robust_variant` of results.json.
        figures: figures by name.
    """
    if not results:
        return []
    found = results["conclusions"]
    lists = [part for key, title in _LISTS.items() if found[key] for part in (tag("h3", title), _sentences(found[key]))]
    conditions = (
        "Runs take 20 s on ODIN under U1 and 120 s on BlueROV2 Heavy at sea; statistics are those of the second half. "
        "Where an ablation is named, its runs take 10 s at 1 kHz (A10 and A18: 20 s) unless stated otherwise, and the "
        "figures are medians over all seeds: of six axes without lag in A1 to A10 and A18, of ODIN with thrusters "
        "without lag in A12 and A13, of ODIN with motors in A20. These conclusions do not extend to longer runs."
    )
    text = (
        "Preset `robust` has the paper's structure, but it works in body axes, includes the motors in its nominal "
        "model, uses the applied instead of the commanded input, bounds its weights, and derives its gains from the "
        "sampling time. This section compares it with the paper's controllers, all of them sampled. Run the commands "
        "in the folder of this page: `undertow simulate` with the file named below each controller. Each ablation is a "
        "file of campaigns/ for `undertow campaign`."
    )
    return [
        tag("p", prose(conditions)),
        *lists,
        tag("h3", "Fidelity levels"),
        tag("p", prose(text)),
        figures.get("robust_fidelity", Html("")),
        fidelity_table(results["fidelity"]),
        *_ablations(results, figures),
    ]


def _ablations(results: Mapping[str, Any], figures: Mapping[str, Html]) -> list[Html]:
    text = (
        f"One element is changed at a time. Disturbances, noise and failures are random, with {results['seeds']} seeds "
        "that are the same for every variant; gains were tuned on other seeds. Statistics are those of the second half "
        "of each run. A run that ended early counts as infinite."
    )
    if results["left_out"]:
        text += f" This quick report uses fewer seeds and leaves out {', '.join(results['left_out'])}."
    return [
        tag("h3", "Ablations"),
        tag("p", prose(text)),
        answers_table(results["ablations"]),
        figures.get("ablations", Html("")),
        tag("details", tag("summary", "Every variant in numbers"), numbers_table(results["ablations"])),
    ]


def _sentences(conclusions: list[str]) -> Html:
    """A list with the topic of each conclusion, up to the first full stop, in bold."""
    items = []
    for sentence in conclusions:
        about, rest = sentence.split(". ", 1)
        items.append(Html(f"<b>{prose(about)}.</b> {prose(rest)}"))
    return bullets(items)


_FIDELITY = ("tracking_rms", "estimation_rms", "input_rms", "input_variation", "saturated_fraction")
_KINDS = {"yes": "holds", "partly": "partly", "no": "fails"}


def fidelity_table(rows: Sequence[Mapping[str, Any]]) -> Html:
    """Every controller in every case, with the command that runs it."""
    shown, last = [], None
    for row in rows:
        steady = row["steady"] or {}
        place = tag("b", row["words"]) if row["words"] != last else ""
        last = row["words"]
        ended = tag("span", ending(row), class_=f"chip {'holds' if row['status'] == 'completed' else 'fails'}")
        name = join(row["name"], tag("div", tag("code", row["scenario"]), class_="small"))
        shown.append((place, name, ended, *(number(steady.get(metric)) for metric in _FIDELITY)))
    metrics = (join(metric.replace("_", " "), " ", unit(unit_of(metric))) for metric in _FIDELITY)
    head = ("case", "controller", "status", *metrics)
    return table(head, shown, numeric=range(3, 3 + len(_FIDELITY)), wide=True)


def answers_table(ablations: Sequence[Mapping[str, Any]]) -> Html:
    """One row per ablation: question, prediction, whether it holds, and the answer with its numbers."""
    rows = []
    for one in ablations:
        said = tag("span", f"as predicted: {one['agrees']}", class_=f"chip {_KINDS[one['agrees']]}")
        left = tag("span", prose(f"left out: {one['left_out']}"), class_="said") if one["left_out"] else ""
        asked = join(prose(one["question"]), tag("span", prose(one["prediction"]), class_="said"))
        rows.append((tag("b", one["id"]), asked, said, join(prose(one["answer"]), left)))
    return table(("", "question, and prediction of the theory", "", "answer"), rows, wide=True)


def numbers_table(ablations: Sequence[Mapping[str, Any]]) -> Html:
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
