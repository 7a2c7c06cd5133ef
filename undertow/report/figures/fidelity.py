"""Figure: one controller on four fidelity levels of the same thruster."""

from collections.abc import Mapping
from typing import Any

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import LogLocator, NullLocator

from undertow.report.figures import recorded, style

_SHOWN = {
    "tracking_rms": "tracking error rms, m and rad",
    "estimation_rms": "estimation error rms, m/s$^2$ and rad/s$^2$",
    "input_variation": "voltage variation, V/s",
    "weights_peak": "largest weight, m/s$^2$ or rad/s$^2$",
}
_MARKS = {"rcafc": "o", "rafc": "s"}

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
        _errors(panel, fidelity, levels[fidelity], runs[fidelity])
        style.label(panel, "time, s", "|error| rms, m and rad" if number == 0 else "", fidelity)
    for number, (metric, text) in enumerate(_SHOWN.items()):
        panel = style.place(figure, 0.56 + 2.38 * number, 0.68 + tall, 1.75, 1.35)
        _metric(panel, levels, metric)
        style.label(panel, "", "", text, style.TINY)
    return figure


def _errors(panel: Axes, fidelity: str, entries: Mapping[str, Any], runs: Mapping[str, xr.Dataset]) -> None:
    """Root mean square over the axes of the tracking error; a cross where a run ended early."""
    panel.set_yscale("log", nonpositive="mask")
    panel.yaxis.set_minor_locator(NullLocator())
    for key, run in runs.items():
        name, look = style.CONTROLLERS[key]
        error = recorded.curve(run, name, "error", look)
        time, size = error.time, np.sqrt((error.values**2).mean(axis=1))
        panel.plot(
            time,
            size,
            color=look.colour,
            linestyle=look.dashes,
            linewidth=look.width,
            zorder=look.order,
            label=f"{name}, {fidelity}",
        )
        if entries[key]["status"] != "completed":
            panel.plot(time[-1], size[-1], "X", color=look.colour, markersize=6, zorder=5)
            _say(panel, f"{name}: {_ending(entries[key])}", (0.98, 0.9))


def _metric(panel: Axes, levels: Mapping[str, Mapping[str, Any]], metric: str) -> None:
    fidelities = list(levels)
    panel.set_yscale("log")
    panel.yaxis.set_major_locator(LogLocator(numticks=5))
    panel.yaxis.set_minor_locator(NullLocator())
    for key, (name, look) in style.CONTROLLERS.items():
        entries = [levels[fidelity].get(key) or {} for fidelity in fidelities]
        values = [(entry.get("steady") or {}).get(metric, np.nan) for entry in entries]
        panel.plot(
            range(len(fidelities)),
            values,
            color=look.colour,
            linestyle=look.dashes,
            linewidth=look.width,
            marker=_MARKS[key],
            markersize=4,
            zorder=look.order,
            label=name,
        )
        for place, entry in enumerate(entries):
            if entry and not entry.get("steady"):
                top = panel.get_xaxis_transform()
                panel.plot(place, 0.93, "X", transform=top, color=look.colour, markersize=6)
                words = {"transform": top, "fontsize": style.TINY, "ha": "right", "va": "center"}
                panel.text(place - 0.15, 0.93, f"{name} {_ending(entry)}", **words)
    panel.set_xticks(
        range(len(fidelities)), [fidelity.replace("electromechanical", "electro-\nmech.") for fidelity in fidelities]
    )
    panel.set_xlim(-0.3, len(fidelities) - 0.7)
    low, high = panel.get_ylim()
    panel.set_ylim(low, high * (high / low) ** 0.25)  # room for what failed


def _ending(entry: Mapping[str, Any]) -> str:
    when = entry.get("diverged_at")
    word = str(entry["status"]).replace("_", " ")
    return word if when is None else f"{word} at {when:.3g} s"


def _say(panel: Axes, text: str, place: tuple[float, float]) -> None:
    panel.text(*place, text, transform=panel.transAxes, fontsize=style.TINY, ha="right", va="top")
