"""The last chapter of the report: the robust variant beside the paper's law."""

from collections.abc import Mapping
from typing import Any

from undertow.report.formats import prose
from undertow.report.page import Html, bullets, tag
from undertow.report.reproduction import robust_tables as tables

FIGURES = ("robust_fidelity", "ablations")

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
    levels = [tag("h3", "Fidelity levels"), tag("p", prose(text)), *_figure(figures, "robust_fidelity")]
    return [
        tag("p", prose(conditions)),
        *lists,
        *levels,
        tables.fidelity(results["fidelity"]),
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
        tables.answers(results["ablations"]),
        *_figure(figures, "ablations"),
        tag("details", tag("summary", "Every variant in numbers"), tables.numbers(results["ablations"])),
    ]


def _sentences(conclusions: list[str]) -> Html:
    """A list with the topic of each conclusion, up to the first full stop, in bold."""
    items = []
    for sentence in conclusions:
        about, rest = sentence.split(". ", 1)
        items.append(Html(f"<b>{prose(about)}.</b> {prose(rest)}"))
    return bullets(items)


def _figure(figures: Mapping[str, Html], name: str) -> list[Html]:
    return [figures[name]] if name in figures else []
