"""Figure of long runs: growth of the weights on every level, and time of divergence for each composite gain."""

from collections.abc import Mapping, Sequence
from typing import Any

from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import NullLocator

from undertow.report.figures import style
from undertow.report.formats import round_time

# Controller -> its name in the key, and its look.
_LOOKS = {
    "rcafc": ("RCAFC, Table 1", style.SOLID),
    "rafc": ("RAFC, Table 1", style.DASHED),
    "w1": (r"RCAFC, $\gamma_\epsilon$ 20", style.Look("#7a5195", (0, (6, 1.5, 1, 1.5)), 1.1, 2)),
    "robust": ("robust", style.Look("#00785a", (0, (1, 1)), 1.3, 4)),
}
_BOUNDED = style.Look("#8c8c8c", "-", 0.8, 1)

_TOP = 1e4  # m/s^2, top of the axis; runs with larger weights are about to diverge

Rows = Sequence[Mapping[str, Any]]


def horizons_figure(rows: Rows, duration: float) -> Figure:
    """Largest weight against time, one panel per level; below, the time of divergence against gamma_eps.

    Args:
        rows: `level`, `law`, `composite`, `bounded`, `lasted`, `ended` (s) and `growth` of each run.
        duration: duration of completed runs, s.
    """
    levels = list(dict.fromkeys(row["level"] for row in rows))
    figure = style.blank(9.6, 4.4)
    style.head(
        figure, f"{duration:.0f} s of suite U2 at 1 kHz", dict(_LOOKS.values()) | {"weights within 20": _BOUNDED}
    )
    for number, level in enumerate(levels):
        panel = style.place(figure, 0.56 + 2.38 * number, 0.62, 1.75, 1.35)
        _growth(panel, [row for row in rows if row["level"] == level and row["law"] in _LOOKS])
        style.label(panel, "time, s", "largest weight, m/s$^2$, rad/s$^2$" if number == 0 else "", level)
    panel = style.place(figure, 0.9, 2.6, 8.3, 1.35)
    _survival(panel, [row for row in rows if row["level"] == levels[-1] and row["composite"] is not None], duration)
    style.label(
        panel,
        r"$\gamma_\epsilon$ (0: RAFC)",
        "time of divergence, s",
        rf"{levels[-1]}: time of divergence by composite gain; five sets, $\gamma$ = 100",
    )
    return figure


def _growth(panel: Axes, rows: Rows) -> None:
    panel.set_xscale("log")
    panel.set_yscale("log")
    style.few_log_ticks(panel.xaxis, panel.yaxis)
    for row in sorted(rows, key=lambda row: not row["bounded"]):
        bounded = row["bounded"] and row["law"] != "robust"
        look = _BOUNDED if bounded else _LOOKS[row["law"]][1]
        time, peak = row["growth"]["time"], row["growth"]["weights_peak"]
        panel.plot(time, peak, **look.line)
        if not row["lasted"]:
            at = max(row["ended"], time[-1]), min(peak[-1], _TOP)
            panel.plot(*at, "X", color=look.colour, markersize=6, zorder=5, clip_on=False)
    panel.set_ylim(1.0, 3 * _TOP)  # room for the crosses


def _survival(panel: Axes, rows: Rows, duration: float) -> None:
    """Bars up to the time of divergence, or up to the duration."""
    panel.set_yscale("log")
    swept = sorted({row["composite"] for row in rows if _of_the_sweep(row)})
    for row in filter(_of_the_sweep, rows):
        position = swept.index(row["composite"]) + (0.16 if row["bounded"] else -0.16)
        colour = _BOUNDED.colour if row["bounded"] else style.SOLID.colour
        at = duration if row["lasted"] else row["ended"]
        panel.plot([position, position], [0.3, at], color=colour, linewidth=6, solid_capstyle="butt", zorder=2)
        words = "completed" if row["lasted"] else f"{round_time(row['ended'])} s"
        panel.text(position, at * 1.15, words, fontsize=style.TINY, ha="center", va="bottom")
    panel.set_xticks(range(len(swept)), [f"{value:g}" for value in swept])
    panel.set_xlim(-0.6, len(swept) - 0.4)
    panel.set_ylim(0.3, duration * 6)
    panel.yaxis.set_minor_locator(NullLocator())


def _of_the_sweep(row: Mapping[str, Any]) -> bool:
    return row["law"] not in ("one_rule", "rafc_equal_gain", "robust")
