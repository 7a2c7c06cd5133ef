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
        "Above, the size of the tracking error against time. Below, its rms over the second half of each run. All runs "
        "are sampled, at 1 kHz on ODIN and at 100 Hz on BlueROV2 Heavy; a cross marks a run that ended early."
    ),
    "ablations": (
        "Dots are medians, thick lines the 95 % interval of the median, thin lines 5 to 95 % of the seeds. A cross "
        "marks runs that ended early, at the right edge without a dot where most did."
    ),
}

_LISTS = {
    "wins": "Where the paper's idea wins",
    "same": "Where a plain linear observer is as good: axes without a motor, 20 s at most",
    "loses": "Where it loses",
    "neither": "Where the robust variant is no better, or costs something",
}


def robust_section(results: Mapping[str, Any], drawn: Mapping[str, Html]) -> list[Html]:
    """Conclusions first, then every fidelity, then the ablations; nothing if the chapter was not run.

    Args:
        results: `robust_variant` of results.json.
        drawn: figures by name.
    """
    if not results:
        return []
    said = results["conclusions"]
    lists = [part for key, title in _LISTS.items() if said[key] for part in (tag("h3", title), _sentences(said[key]))]
    told = (
        "Preset `robust` has the paper's structure, but works in body axes, knows the motors, is fed with what was "
        "applied within limits, keeps its weights in a box and takes its gains from the sampling time. Here it meets "
        "the paper's laws, all of them sampled. The commands are to be typed in the folder of this page: `undertow "
        "simulate` and the file named below each law; each ablation is `undertow campaign` and a file of campaigns/."
    )
    compared = [tag("h3", "Every fidelity again"), tag("p", prose(told)), *_figure(drawn, "robust_fidelity")]
    return [*lists, *compared, tables.fidelity(results["fidelity"]), *_ablations(results, drawn)]


def _ablations(results: Mapping[str, Any], drawn: Mapping[str, Html]) -> list[Html]:
    told = (
        f"One thing is changed at a time. Loads, noise and failures are drawn anew for each of {results['seeds']} "
        "seeds, the same for every variant, and gains that were searched for were found on other seeds. Statistics "
        "are those of the second half of each run; a run that ended early counts as infinitely bad."
    )
    if results["left_out"]:
        told += f" This quick look has fewer seeds and leaves out {', '.join(results['left_out'])}."
    return [
        tag("h3", "Ablations"),
        tag("p", prose(told)),
        tables.answers(results["ablations"]),
        *_figure(drawn, "ablations"),
        tag("details", tag("summary", "Every variant in numbers"), tables.numbers(results["ablations"])),
    ]


def _sentences(said: list[str]) -> Html:
    """What it is about, up to the first full stop, in bold."""
    items = []
    for sentence in said:
        about, rest = sentence.split(". ", 1)
        items.append(Html(f"<b>{prose(about)}.</b> {prose(rest)}"))
    return bullets(items)


def _figure(drawn: Mapping[str, Html], name: str) -> list[Html]:
    return [drawn[name]] if name in drawn else []
