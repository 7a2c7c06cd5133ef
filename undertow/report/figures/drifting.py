"""Figure: drifting weights add damping; gain, chattering and error of Table 1 behind a lag, against time."""

from collections.abc import Mapping
from typing import Any

from matplotlib.figure import Figure
from matplotlib.ticker import LogLocator, NullLocator

from undertow.report.figures import style

_LOOKS = {"free": ("weights free", style.SOLID), "bounded": ("weights within 20", style.DASHED)}


def drifting_figure(shown: Mapping[str, Any]) -> Figure:
    """Three panels.

    Args:
        shown: `lag` (s), `needed` (the gain c that the linearised loop requires, 1/s), and `runs`: by name
            (free, bounded) `time`, `gain` by axis, `input_variation` and `tracking`.
    """
    figure = style.blank(9.6, 2.5)
    needed = style.Look("#000000", (0, (1, 1.8)), 1.1, 4)
    keys = dict(_LOOKS.values()) | {"c at which the linearised loop is stable": needed}
    style.head(figure, f"Behind a lag of {1e3 * shown['lag']:g} ms", keys)
    titles = ("gain c of each axis, 1/s", "voltage variation, V/s", "|error| rms, m and rad")
    panels = [style.place(figure, 0.56 + 3.1 * number, 0.62, 2.45, 1.35) for number in range(3)]
    for name, run in shown["runs"].items():
        _, look = _LOOKS[name]
        plain = {"color": look.colour, "linestyle": look.dashes, "linewidth": look.width}
        for gain in run["gain"]:
            panels[0].plot(run["time"], gain, **plain)
        panels[1].plot(run["time"], run["input_variation"], **plain)
        panels[2].plot(run["time"], run["tracking"], **plain)
    if shown["needed"] is not None:
        panels[0].axhline(shown["needed"], color=needed.colour, linestyle=needed.dashes, linewidth=needed.width)
    for panel, title in zip(panels, titles, strict=True):
        style.label(panel, "time, s", "", title, style.TINY)
    for panel in panels[1:]:
        panel.set_yscale("log")
        panel.yaxis.set_major_locator(LogLocator(numticks=5))
        panel.yaxis.set_minor_locator(NullLocator())
    return figure
