"""Figure: the robust variant and the paper's controllers on every fidelity level, and under limits and disturbances."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import LogLocator, NullLocator

from undertow.report.figures import style

# Names, looks and marks of the controllers.
_LOOKS = {
    "rcafc": ("RCAFC, Table 1", style.SOLID, "o"),
    "table1": ("RCAFC, Table 1", style.SOLID, "o"),
    "rafc": ("RAFC, Table 1", style.DASHED, "s"),
    "hand_tuned": ("paper's controller, tuned by hand", style.Look("#7a5195", (0, (6, 1.5, 1, 1.5)), 1.1, 2), "D"),
    "pid": ("PID", style.Look("#8a6d00", (0, (3, 1)), 1.1, 2), "v"),
    "robust": ("robust", style.Look("#00785a", "-", 1.3, 4), "^"),
    "measured": ("speeds measured", style.Look("#b0476f", (0, (1, 1)), 1.1, 5), "."),
}
_SHOWN = ("electromechanical", "24V_03", "overload", "sea")
_TITLES = {
    "electromechanical": "full motor model, no limit",
    "24V_03": "24 V, U1 x 0.3",
    "overload": "24 V, overload for 1.5 s",
    "sea": "BlueROV2 Heavy, current and waves",
}

Rows = Sequence[Mapping[str, Any]]


def robust_fidelity_figure(rows: Rows, datasets: Mapping[tuple[str, str], xr.Dataset]) -> Figure:
    """Errors against time in up to four cases, and below them the steady tracking error in all cases.

    Args:
        rows: `place`, `words`, `law`, `status`, `diverged_at` and `steady` of each run.
        datasets: runs by place and law; missing ones are not plotted.
    """
    places = list(dict.fromkeys(row["place"] for row in rows))
    shown = [place for place in _SHOWN if any(place == where for where, _ in datasets)]
    tall = 1.75 if shown else 0.0
    figure = style.blank(9.6, 0.85 + tall + 0.27 * len(places) + 0.35)
    laws = dict(_LOOKS[row["law"]][:2] for row in rows)
    style.head(figure, "The robust variant on every fidelity level", laws)
    for number, place in enumerate(shown):
        panel = style.place(figure, 0.56 + 2.38 * number, 0.6, 1.75, 1.2)
        _errors(panel, {law: run for (where, law), run in datasets.items() if where == place})
        style.label(panel, "time, s", "|error| rms, m and rad" if number == 0 else "", _TITLES[place])
    panel = style.place(figure, 3.3, 0.62 + tall, 6.0, 0.27 * len(places))
    _dots(panel, places, rows)
    style.label(panel, "tracking error rms over the second half, m and rad; cross: ended early")
    return figure


def _errors(panel: Axes, runs: Mapping[str, xr.Dataset]) -> None:
    panel.set_yscale("log", nonpositive="mask")
    panel.yaxis.set_major_locator(LogLocator(numticks=5))
    panel.yaxis.set_minor_locator(NullLocator())
    for law, run in runs.items():
        _, look, _ = _LOOKS[law]
        size = np.sqrt((run["error"].values ** 2).mean(axis=1))
        time, ended = run["time"].values, float(run.attrs["ended"])
        kept = time <= ended
        panel.plot(
            time[kept], size[kept], color=look.colour, linestyle=look.dashes, linewidth=look.width, zorder=look.order
        )
        if run.attrs["status"] != "completed":
            panel.plot(time[kept][-1], size[kept][-1], "X", color=look.colour, markersize=6, zorder=6)


def _dots(panel: Axes, places: Sequence[str], rows: Rows) -> None:
    panel.set_xscale("log")
    panel.xaxis.set_major_locator(LogLocator(numticks=8))
    panel.xaxis.set_minor_locator(NullLocator())
    words = {row["place"]: row["words"] for row in rows}
    for row in rows:
        _, look, mark = _LOOKS[row["law"]]
        height = places.index(row["place"])
        if row["steady"]:
            value = row["steady"]["tracking_rms"]
            panel.plot(
                value, height, mark, color=look.colour, markerfacecolor="white", markersize=5.5, zorder=look.order
            )
        else:
            panel.plot(0.985, height, "X", transform=panel.get_yaxis_transform(), color=look.colour, markersize=6)
    panel.set_yticks(range(len(places)), [_wrapped(words[place]) for place in places], fontsize=style.SMALL)
    panel.set_ylim(len(places) - 0.5, -0.5)
    low, high = panel.get_xlim()
    panel.set_xlim(low, high * 3)  # room for what ended early


def _wrapped(words: str) -> str:
    """Long text on two lines."""
    if len(words) < 50:
        return words
    middle = words.rfind(" ", 0, 48)
    return f"{words[:middle]}\n{words[middle + 1 :]}"
