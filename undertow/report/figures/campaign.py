"""Figures of a campaign: empirical distribution functions of the metrics, and rank correlations."""

from collections.abc import Mapping
from typing import Any

import numpy as np
from matplotlib.figure import Figure
from matplotlib.ticker import NullFormatter

from undertow.report.figures import style

# The metrics to plot, where they are defined.
_SHOWN = (
    "position_rms",
    "attitude_rms",
    "tracking_rms",
    "position_estimation_rms",
    "attitude_estimation_rms",
    "estimation_rms",
    "input_rms",
    "input_variation",
    "saturated_fraction",
)
LOOKS = (
    style.SOLID,
    style.DASHED,
    style.Look("#00785a", "-", 1.7, 4),
    style.Look("#b0476f", (0, (1, 1)), 1.1, 5),
    style.Look("#333333", (0, (6, 1.5, 1, 1.5)), 1.1, 6),
    style.Look("#56a4d4", (0, (2, 1)), 1.6, 7),
    style.Look("#a0840a", "-", 0.7, 8),
    style.Look("#7a5195", (0, (8, 2)), 1.3, 9),
)
_COLUMNS = 3
_WIDE = 100.0  # ratio of largest and smallest from which on an axis is logarithmic
_DARK = 0.6  # correlations above this have a dark background


def distributions_figure(
    values: Mapping[str, Mapping[str, np.ndarray]], counts: Mapping[str, int], units: Mapping[str, str]
) -> Figure:
    """Empirical cumulative distribution functions of the metrics; failed trials count as infinite values.

    Args:
        values: metric -> name of the combination -> finite values, in any order; the first eight are plotted.
        counts: name of the combination -> number of its trials, including failed ones.
        units: metric -> unit.
    """
    shown = [name for name in _SHOWN if name in values]
    rows = -(-len(shown) // _COLUMNS)
    names = list(dict.fromkeys(name for each in values.values() for name in each))
    looks = dict(zip(names, LOOKS, strict=False))
    beside = max(1, int(9.4 / (0.8 + 0.065 * max(map(len, looks)))))  # entries of the key in a line
    key = 0.2 * -(-len(looks) // beside) if len(looks) > 1 else 0.0
    figure = style.blank(9.6, 0.35 + key + 2.25 * rows)
    style.head(figure, "Empirical CDF of the metrics", {})
    if key:
        style.key(figure, looks, 0.3, beside)
    for i, metric in enumerate(shown):
        row, column = divmod(i, _COLUMNS)
        panel = style.place(figure, 0.6 + 3.1 * column, 0.65 + key + 2.25 * row, 2.35, 1.45)
        for name, look in looks.items():
            ordered = np.sort(values[metric].get(name, np.zeros(0)))
            share = np.arange(1, len(ordered) + 1) / max(1, counts[name])
            panel.step(ordered, share, where="post", color=look.colour, linestyle=look.dashes, linewidth=look.width)
        everything = np.concatenate(list(values[metric].values()))
        if everything.min() > 0 and everything.max() > _WIDE * everything.min():
            panel.set_xscale("log")
            panel.xaxis.set_minor_formatter(NullFormatter())  # their numbers would run into one another
        panel.set_ylim(0, 1)
        said = [style.power(unit) for unit in units[metric].split(", ") if unit]
        style.label(panel, ", ".join([metric.replace("_", " "), *said]))
        panel.xaxis.set_label_coords(0.5, -0.19)  # clear of powers of ten
    return figure


def sensitivity_figure(found: Mapping[str, Mapping[str, Any]]) -> Figure:
    """Rank correlation of each metric with each parameter, as a matrix.

    Args:
        found: parameter -> metric -> correlation.
    """
    metrics = list(dict.fromkeys(metric for each in found.values() for metric in each))
    lines = 1 + max(key.count(".") for key in found)
    figure = style.blank(9.6, 0.85 + 0.15 * lines + 0.3 * len(metrics))
    style.head(figure, "Rank correlation with the varied parameters", {})
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
