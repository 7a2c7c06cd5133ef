"""How the metrics of a campaign are distributed, and what they depend on."""

from collections.abc import Mapping
from typing import Any

import numpy as np
from matplotlib.figure import Figure
from matplotlib.ticker import NullFormatter

from undertow.report.figures import style

# The metrics that are drawn, where they are there.
_SHOWN = ("tracking_rms", "tracking_max", "estimation_rms", "voltage_rms", "voltage_variation", "saturated_fraction")
_LOOKS = (style.SOLID, style.DASHED, style.Look("#00785a", "-", 1.3, 4), style.Look("#b0476f", (0, (1, 1)), 1.1, 5))
_COLUMNS = 3
_WIDE = 100.0  # ratio of largest and smallest from which on an axis is logarithmic
_DARK = 0.6  # correlations beyond this stand on dark ground


def distributions_figure(values: Mapping[str, Mapping[str, np.ndarray]]) -> Figure:
    """Share of trials below each value of a metric: the empirical distribution function.

    Args:
        values: metric -> name of the combination -> finite values, in any order.
    """
    shown = [name for name in _SHOWN if name in values]
    rows = -(-len(shown) // _COLUMNS)
    figure = style.blank(9.6, 0.35 + 2.25 * rows)
    names = list(dict.fromkeys(name for each in values.values() for name in each))
    looks = {name: _LOOKS[i % len(_LOOKS)] for i, name in enumerate(names)}
    style.head(figure, "Share of the trials below", looks if len(names) > 1 else {})
    for i, metric in enumerate(shown):
        row, column = divmod(i, _COLUMNS)
        panel = style.place(figure, 0.6 + 3.1 * column, 0.65 + 2.25 * row, 2.35, 1.45)
        for name, found in values[metric].items():
            ordered = np.sort(found)
            share, look = np.arange(1, len(ordered) + 1) / len(ordered), looks[name]
            panel.step(ordered, share, where="post", color=look.colour, linestyle=look.dashes, linewidth=look.width)
        everything = np.concatenate(list(values[metric].values()))
        if everything.min() > 0 and everything.max() > _WIDE * everything.min():
            panel.set_xscale("log")
            panel.xaxis.set_minor_formatter(NullFormatter())  # their numbers would run into one another
        panel.set_ylim(0, 1)
        style.label(panel, metric.replace("_", " "))
    return figure


def sensitivity_figure(found: Mapping[str, Mapping[str, Any]]) -> Figure:
    """Rank correlation of each metric with each parameter, as a field of numbers.

    Args:
        found: parameter -> metric -> correlation.
    """
    metrics = list(dict.fromkeys(metric for each in found.values() for metric in each))
    lines = 1 + max(key.count(".") for key in found)
    figure = style.blank(9.6, 0.85 + 0.15 * lines + 0.3 * len(metrics))
    style.head(figure, "Rank correlation with what varies", {})
    panel = style.place(figure, 2.2, 0.6, 7.0, 0.3 * len(metrics))
    field = np.array([[each.get(metric, np.nan) for each in found.values()] for metric in metrics])
    panel.imshow(field, cmap="RdBu_r", vmin=-1, vmax=1, aspect="auto")
    for row, column in np.ndindex(*field.shape):
        number = field[row, column]
        ink = "white" if abs(number) > _DARK else "black"
        panel.text(column, row, f"{number:+.2f}", ha="center", va="center", fontsize=style.SMALL, color=ink)
    panel.set_xticks(range(len(found)), [key.replace(".", ".\n") for key in found], fontsize=style.SMALL)
    panel.set_yticks(range(len(metrics)), [metric.replace("_", " ") for metric in metrics], fontsize=style.SMALL)
    panel.grid(visible=False)
    return figure
