"""Figures over the fidelity levels of the thruster: the paper's controllers, and the robust variant beside them."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import NullLocator

from undertow.report.figures import recorded, style
from undertow.report.formats import ending

_SHOWN = {
    "tracking_rms": "tracking error rms, m and rad",
    "estimation_rms": "estimation error rms, m/s$^2$ and rad/s$^2$",
    "input_variation": "voltage variation, V/s",
    "weights_peak": "largest weight, m/s$^2$ or rad/s$^2$",
}

Runs = Mapping[str, Mapping[str, xr.Dataset]]  # fidelity, controller


def fidelity_figure(levels: Mapping[str, Mapping[str, Any]], datasets: Runs | None = None) -> Figure:
    """Error against time on every fidelity, and metrics over the fidelities.

    Args:
        levels: by fidelity and controller, `status`, `diverged_at` (s or None), `steady` (metrics or None).
        datasets: the runs, by fidelity and controller; without them only the metrics are plotted.
    """
    runs = datasets or {}
    tall = 1.75 if runs else 0.0
    figure = style.blank(9.6, 0.55 + tall + 1.95)
    style.head(figure, "Fidelity levels: one controller, four thruster models", dict(style.CONTROLLERS.values()))
    for number, fidelity in enumerate(fidelity for fidelity in levels if fidelity in runs):
        panel = style.place(figure, 0.56 + 2.38 * number, 0.58, 1.75, 1.25)
        panel.set_yscale("log", nonpositive="mask")
        panel.yaxis.set_minor_locator(NullLocator())
        for key, run in runs[fidelity].items():
            name, look = style.CONTROLLERS[key]
            _error(panel, run, look, f"{name}, {fidelity}")
            if (entry := levels[fidelity][key])["status"] != "completed":
                words = {"transform": panel.transAxes, "fontsize": style.TINY, "ha": "right", "va": "top"}
                panel.text(0.98, 0.9, f"{name}: {ending(entry)}", **words)
        style.label(panel, "time, s", "|error| rms, m and rad" if number == 0 else "", fidelity)
    for number, (metric, text) in enumerate(_SHOWN.items()):
        panel = style.place(figure, 0.56 + 2.38 * number, 0.68 + tall, 1.75, 1.35)
        _metric(panel, levels, metric)
        style.label(panel, "", "", text, style.TINY)
    return figure


def _error(panel: Axes, run: xr.Dataset, look: style.Look, name: str) -> None:
    """Root mean square over the axes of the tracking error; a cross where a run ended early."""
    error = recorded.curve(run, name, "error", look)
    size = np.sqrt((error.values**2).mean(axis=1))
    panel.plot(error.time, size, **look.line, label=name)
    if run.attrs["status"] != "completed":
        panel.plot(error.time[-1], size[-1], "X", color=look.colour, markersize=6, zorder=6)


def _metric(panel: Axes, levels: Mapping[str, Mapping[str, Any]], metric: str) -> None:
    fidelities = list(levels)
    panel.set_yscale("log")
    style.few_log_ticks(panel.yaxis)
    for key, (name, look) in style.CONTROLLERS.items():
        entries = [levels[fidelity].get(key) or {} for fidelity in fidelities]
        values = [(entry.get("steady") or {}).get(metric, np.nan) for entry in entries]
        panel.plot(range(len(fidelities)), values, **look.line, marker=style.MARKS[key], markersize=4, label=name)
        for position, entry in enumerate(entries):
            if entry and not entry.get("steady"):
                top = panel.get_xaxis_transform()
                panel.plot(position, 0.93, "X", transform=top, color=look.colour, markersize=6)
                words = {"transform": top, "fontsize": style.TINY, "ha": "right", "va": "center"}
                panel.text(position - 0.15, 0.93, f"{name} {ending(entry)}", **words)
    panel.set_xticks(
        range(len(fidelities)), [fidelity.replace("electromechanical", "electro-\nmech.") for fidelity in fidelities]
    )
    panel.set_xlim(-0.3, len(fidelities) - 0.7)
    low, high = panel.get_ylim()
    panel.set_ylim(low, high * (high / low) ** 0.25)  # room for what failed


# Names, looks and marks of the controllers beside the robust variant.
_LAWS = {
    "rcafc": ("RCAFC, Table 1", style.SOLID, "o"),
    "table1": ("RCAFC, Table 1", style.SOLID, "o"),
    "rafc": ("RAFC, Table 1", style.DASHED, "s"),
    "hand_tuned": ("paper's controller, tuned by hand", style.Look("#7a5195", (0, (6, 1.5, 1, 1.5)), 1.1, 2), "D"),
    "pid": ("PID", style.Look("#8a6d00", (0, (3, 1)), 1.1, 2), "v"),
    "robust": ("robust", style.Look("#00785a", "-", 1.3, 4), "^"),
    "measured": ("speeds measured", style.Look("#b0476f", (0, (1, 1)), 1.1, 5), "."),
}
# The cases that are shown against time, and their titles.
_CASES = {
    "electromechanical": "full motor model, no limit",
    "24V_03": "24 V, U1 x 0.3",
    "overload": "24 V, overload for 1.5 s",
    "sea": "BlueROV2 Heavy at sea",
}

Rows = Sequence[Mapping[str, Any]]


def robust_fidelity_figure(rows: Rows, datasets: Mapping[tuple[str, str], xr.Dataset]) -> Figure:
    """Errors against time in up to four cases, and below them the steady tracking error in all cases.

    Args:
        rows: `place`, `words`, `law`, `status`, `diverged_at` and `steady` of each run.
        datasets: runs by place and law; missing ones are not plotted.
    """
    cases = list(dict.fromkeys(row["place"] for row in rows))
    plotted_cases = [case for case in _CASES if any(case == where for where, _ in datasets)]
    tall = 1.75 if plotted_cases else 0.0
    figure = style.blank(9.6, 1.05 + tall + 0.27 * len(cases) + 0.35)
    style.head(figure, "The robust variant on every fidelity level", {})
    laws = dict(_LAWS[row["law"]][:2] for row in rows)
    style.key(figure, laws, 0.28, len(laws))
    for number, case in enumerate(plotted_cases):
        panel = style.place(figure, 0.56 + 2.38 * number, 0.8, 1.75, 1.2)
        panel.set_yscale("log", nonpositive="mask")
        style.few_log_ticks(panel.yaxis)
        for law in (law for where, law in datasets if where == case):
            name, look, _ = _LAWS[law]
            _error(panel, datasets[case, law], look, name)
        style.label(panel, "time, s", "|error| rms, m and rad" if number == 0 else "", _CASES[case])
    panel = style.place(figure, 3.3, 0.82 + tall, 6.0, 0.27 * len(cases))
    _dots(panel, cases, rows)
    style.label(panel, "tracking error rms over the second half, m and rad; cross: ended early")
    return figure


def _dots(panel: Axes, cases: Sequence[str], rows: Rows) -> None:
    panel.set_xscale("log")
    style.few_log_ticks(panel.xaxis, most=8)
    words = {row["place"]: row["words"] for row in rows}
    for row in rows:
        _, look, mark = _LAWS[row["law"]]
        height = cases.index(row["place"])
        if row["steady"]:
            marked = {"color": look.colour, "markerfacecolor": "white", "markersize": 5.5, "zorder": look.order}
            panel.plot(row["steady"]["tracking_rms"], height, mark, **marked)
        else:
            panel.plot(0.985, height, "X", transform=panel.get_yaxis_transform(), color=look.colour, markersize=6)
    panel.set_yticks(range(len(cases)), [_wrapped(words[case]) for case in cases], fontsize=style.SMALL)
    panel.set_ylim(len(cases) - 0.5, -0.5)
    low, high = panel.get_xlim()
    panel.set_xlim(low, high * 3)  # room for what ended early


def _wrapped(words: str) -> str:
    """Long text on two lines."""
    if len(words) < 50:
        return words
    middle = words.rfind(" ", 0, 48)
    return f"{words[:middle]}\n{words[middle + 1 :]}"
