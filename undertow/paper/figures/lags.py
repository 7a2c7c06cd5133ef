"""Figure: error, chattering, weights and duration of Table 1 behind a first-order lag and behind a winding."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from undertow.report.figures import style

_METRICS = {
    "tracking_rms": "tracking error rms, m and rad",
    "input_variation": "voltage variation, V/s",
    "weights_peak": "largest weight, m/s$^2$, rad/s$^2$",
}
_KINDS = {"lag": "first-order lag, ms", "winding": "inductance of the winding, mH"}
_LAWS = {"five": ("five sets", "#0072b2", "o"), "one": ("one rule, same loop gain", "#e07b00", "s")}
_DASHES = ((0, (1, 1.2)), (0, (4, 1.6)), "-")  # the shorter the horizon, the shorter the dashes

Rows = Sequence[Mapping[str, Any]]


def lags_figure(rows: Rows, windows: Sequence[Sequence[float]]) -> Figure:
    """Metrics in every window over lag and inductance, and the time at which runs ended.

    Args:
        rows: `kind`, `value`, `law`, `ended` (s), `lasted`, and by window `tracking_rms` and so on, of each run.
        windows: first and last time of each, s.
    """
    keys = {name: style.Look(colour, "-", 1.2, 3) for law, (name, colour, _) in _LAWS.items() if _of(rows, law=law)}
    dashes = (
        dict(zip(map(tuple, windows), _DASHES[-len(windows) :], strict=True)) if len(windows) <= len(_DASHES) else {}
    )
    keys |= {f"{a:g} to {b:g} s": style.Look(style.INK, look, 1.1, 1) for (a, b), look in dashes.items()}
    kinds = [kind for kind in _KINDS if _of(rows, kind=kind)]
    figure = style.blank(9.6, 0.5 + 2.05 * len(kinds))
    style.head(figure, "Table 1 behind a lag", keys)
    for number, kind in enumerate(kinds):
        words = _KINDS[kind]
        top = 0.6 + 2.05 * number
        for column, (metric, title) in enumerate(_METRICS.items()):
            panel = style.place(figure, 0.56 + 2.38 * column, top, 1.75, 1.3)
            _metric(panel, _of(rows, kind=kind), metric, list(dashes.values()))
            style.label(panel, words, "", title, style.TINY)
        panel = style.place(figure, 0.56 + 2.38 * 3, top, 1.75, 1.3)
        _life(panel, _of(rows, kind=kind), max(row["ended"] for row in rows))
        style.label(panel, words, "", "ended after, s (hollow: completed)", style.TINY)
    return figure


def _of(rows: Rows, **where: str) -> list[Mapping[str, Any]]:
    return [row for row in rows if all(row[key] == value for key, value in where.items())]


def _logarithmic(panel: Axes) -> None:
    panel.set_xscale("log")
    panel.set_yscale("log")
    style.few_log_ticks(panel.xaxis, panel.yaxis)


def _metric(panel: Axes, rows: Rows, metric: str, dashes: Sequence[Any]) -> None:
    _logarithmic(panel)
    for law, (_, colour, mark) in _LAWS.items():
        for number, look in enumerate(dashes):
            points = [(1e3 * row["value"], row[metric][number]) for row in _of(rows, law=law)]
            points = [(x, y) for x, y in points if y is not None]
            if points:
                panel.plot(
                    *zip(*points, strict=True),
                    mark,
                    color=colour,
                    linestyle=look,
                    linewidth=1.1,
                    markersize=3,
                    label=law,
                )
    low, high = np.log10(panel.get_ylim())
    panel.set_ylim(10 ** np.floor(low), 10 ** np.ceil(high))  # whole decades: two labels at least


def _life(panel: Axes, rows: Rows, longest: float) -> None:
    _logarithmic(panel)
    for law, (_, colour, mark) in _LAWS.items():
        for row in _of(rows, law=law):
            inside = "white" if row["lasted"] else colour
            panel.plot(1e3 * row["value"], row["ended"], mark, color=colour, markerfacecolor=inside, markersize=4.5)
    panel.set_ylim(0.5, 3 * longest)


_LOOKS = {"free": ("weights free", style.SOLID), "bounded": ("weights within 20", style.DASHED)}


def drifting_figure(drifting: Mapping[str, Any]) -> Figure:
    """Three panels.

    Args:
        drifting: `lag` (s), `needed` (the gain c that the linearised loop requires, 1/s), and `runs`: by name
            (free, bounded) `time`, `gain` by axis, `input_variation` and `tracking`.
    """
    figure = style.blank(9.6, 2.5)
    needed = style.Look("#000000", (0, (1, 1.8)), 1.1, 4)
    keys = dict(_LOOKS.values()) | {"c at which the linearised loop is stable": needed}
    style.head(figure, f"Behind a lag of {1e3 * drifting['lag']:g} ms", keys)
    titles = ("gain c of each axis, 1/s", "voltage variation, V/s", "|error| rms, m and rad")
    panels = [style.place(figure, 0.56 + 3.1 * number, 0.62, 2.45, 1.35) for number in range(3)]
    for name, run in drifting["runs"].items():
        _, look = _LOOKS[name]
        plain = {"color": look.colour, "linestyle": look.dashes, "linewidth": look.width}
        for gain in run["gain"]:
            panels[0].plot(run["time"], gain, **plain)
        panels[1].plot(run["time"], run["input_variation"], **plain)
        panels[2].plot(run["time"], run["tracking"], **plain)
    if drifting["needed"] is not None:
        panels[0].axhline(drifting["needed"], color=needed.colour, linestyle=needed.dashes, linewidth=needed.width)
    for panel, title in zip(panels, titles, strict=True):
        style.label(panel, "time, s", "", title, style.TINY)
    for panel in panels[1:]:
        panel.set_yscale("log")
        style.few_log_ticks(panel.yaxis)
    return figure
