"""The last chapter of the report: the robust variant beside the paper's law."""

from collections.abc import Mapping, Sequence
from typing import Any

from undertow.paper.all_outputs import unit_of
from undertow.paper.pages import ablations_page
from undertow.report.formats import CRITERION, ending, meets_default_criterion, number, outcome, prose, unit
from undertow.report.page import Html, bullets, join, table, tag

TITLE = "The robust variant"

CAPTIONS = {
    "robust_fidelity": (
        "The upper panels show the size of the tracking error against time, the lower panel its rms over the second "
        "half of each run. All runs are sampled, at 1 kHz on ODIN and at 100 Hz on BlueROV2 Heavy. A cross marks a run "
        "that ended early."
    )
}

_LISTS = {
    "wins": "Advantages of the paper's approach",
    "same": "Cases in which a linear observer performs as well: axes without a motor, 20 s at most",
    "loses": "Disadvantages of the paper's approach",
    "neither": "Cases in which the robust variant is no better, or has a cost",
}


def robust_section(results: Mapping[str, Any], figures: Mapping[str, Html]) -> list[Html]:
    """Conclusions first, then every fidelity, then a list of the ablations; nothing if the chapter was not run.

    Args:
        results: `robust_variant` of results.json.
        figures: figures by name.
    """
    if not results:
        return []
    conclusions = results["conclusions"]
    lists = []
    for key, title in _LISTS.items():
        if conclusions[key]:
            lists += [tag("h3", title), _sentences(conclusions[key])]
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
        "in the folder of this page: `undertow simulate` with the file named below each controller."
    )
    return [
        tag("p", prose(conditions)),
        *lists,
        tag("h3", "Fidelity levels"),
        tag("p", prose(text)),
        tag("p", prose(CRITERION)),
        figures.get("robust_fidelity", Html("")),
        fidelity_table(results["fidelity"]),
        *_ablations(results),
    ]


def _ablations(results: Mapping[str, Any]) -> list[Html]:
    page = tag("a", "a page of its own", href=ablations_page.NAME)
    text = (
        " has the answer to each question, with the prediction of the theory, the campaign file, the command that runs "
        "it alone, and every variant in numbers."
    )
    return [
        tag("h3", "Ablations"),
        tag("p", join("One element is changed at a time. ", Html("The ablations have "), page, ", which", text)),
        tag("p", prose(ablations_page.left_out(results))),
        ablations_page.answers_table(results["ablations"], ablations_page.NAME),
    ]


def _sentences(conclusions: list[str]) -> Html:
    """A list with the topic of each conclusion, up to the first full stop, in bold."""
    items = []
    for sentence in conclusions:
        topic, statement = sentence.split(". ", 1)
        items.append(Html(f"<b>{prose(topic)}.</b> {prose(statement)}"))
    return bullets(items)


_FIDELITY = ("tracking_rms", "estimation_rms", "input_rms", "input_variation", "saturated_fraction")


def fidelity_table(rows: Sequence[Mapping[str, Any]]) -> Html:
    """Every controller in every case, with the command that runs it."""
    table_rows = []
    last = None
    for row in rows:
        steady = row["steady"] or {}
        case = tag("b", row["words"]) if row["words"] != last else ""
        last = row["words"]
        ended = outcome(ending(row), row["status"] == "completed", meets_default_criterion(row["steady"]))
        name = join(row["name"], tag("div", tag("code", row["scenario"]), class_="small"))
        table_rows.append((case, name, ended, *(number(steady.get(metric)) for metric in _FIDELITY)))
    metrics = (join(metric.replace("_", " "), " ", unit(unit_of(metric))) for metric in _FIDELITY)
    head = ("case", "controller", "status", *metrics)
    return table(head, table_rows, numeric=range(3, 3 + len(_FIDELITY)), wide=True)
