"""Figures of a campaign: empirical distribution functions of the metrics, and rank correlations."""

import itertools
from collections.abc import Mapping, Sequence

import numpy as np
from matplotlib.figure import Figure
from matplotlib.ticker import NullFormatter

from undertow.analysis.metrics import titled_name
from undertow.report.figures import style

# The metrics to plot, where they are defined.
SHOWN = (
    "position_rms",
    "attitude_rms",
    "tracking_rms",
    "position_estimation_rms",
    "attitude_estimation_rms",
    "estimation_rms",
    "energy",
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
_MOST_INPUTS = 24  # of the matrix of correlations
_LETTER = 0.058  # in, mean width of a letter in its names
_MOST_STEPS = 2000  # of a distribution function: more cannot be seen
_HUNDREDTH = 0.005  # what rounds to less is zero


def looks_of(names: Sequence[str]) -> dict[str, style.Look]:
    """Colours and dashes of controllers or scenarios that are compared."""
    return dict(zip(names, itertools.cycle(LOOKS), strict=False))


def beside(key: Mapping[str, style.Look]) -> int:
    """Entries of a key in a line."""
    return max(1, int(9.4 / (0.8 + 0.065 * max(map(len, key)))))


def key_height(key: Mapping[str, style.Look]) -> float:
    """Height of a key, in."""
    return 0.2 * -(-len(key) // beside(key))


def _differs(by_combination: Mapping[str, np.ndarray]) -> bool:
    """Whether a metric has more than one value over all trials."""
    return len(np.unique(np.concatenate(list(by_combination.values())))) > 1


def distributions_figure(
    values: Mapping[str, Mapping[str, np.ndarray]], counts: Mapping[str, int], units: Mapping[str, str]
) -> Figure:
    """Empirical cumulative distribution functions of the metrics; failed trials count as infinite values.

    Args:
        values: metric -> name of the combination -> finite values, in any order; of those that differ, the first eight
            are plotted.
        counts: name of the combination -> number of its trials, including failed ones.
        units: metric -> unit.
    """
    metrics = [name for name in SHOWN if name in values]
    metrics = [name for name in metrics if _differs(values[name])] or metrics
    rows = -(-len(metrics) // _COLUMNS)
    names = list(dict.fromkeys(name for by_combination in values.values() for name in by_combination))
    looks = dict(zip(names, LOOKS, strict=False))
    key = key_height(looks) if len(looks) > 1 else 0.0
    figure = style.blank(9.6, 0.35 + key + 2.25 * rows)
    style.head(figure, "Empirical CDF of the metrics", {})
    if key:
        style.key(figure, looks, 0.3, beside(looks))
    for i, metric in enumerate(metrics):
        row, column = divmod(i, _COLUMNS)
        panel = style.place(figure, 0.6 + 3.1 * column, 0.65 + key + 2.25 * row, 2.35, 1.45)
        for name, look in looks.items():
            ordered = np.sort(values[metric].get(name, np.zeros(0)))
            rank = np.unique(np.linspace(1, len(ordered), min(len(ordered), _MOST_STEPS)).round().astype(int))
            panel.step(
                ordered[rank - 1],
                rank / max(1, counts[name]),
                where="post",
                color=look.colour,
                linestyle=look.dashes,
                linewidth=look.width,
            )
        all_values = np.concatenate(list(values[metric].values()))
        if all_values.min() > 0 and all_values.max() > _WIDE * all_values.min():
            panel.set_xscale("log")
            panel.xaxis.set_minor_formatter(NullFormatter())  # their numbers would run into one another
        panel.set_ylim(0, 1.04)  # the line at 1 in its whole width
        metric_units = [style.power(unit) for unit in units[metric].split(", ") if unit]
        words = ", ".join([titled_name(metric), *metric_units])
        style.label(panel, words, "" if column else "share of the trials", below=0.27)  # clear of powers of ten
    return figure


def shown_inputs(correlations: Mapping[str, Mapping[str, float]]) -> list[str]:
    """Inputs that the figure of the sensitivities shows: the first ones, which are those of `vary`."""
    return list(correlations)[:_MOST_INPUTS]


def sensitivity_figure(correlations: Mapping[str, Mapping[str, float]], varied: int) -> Figure:
    """Rank correlation of each metric (columns) with each input (rows), as a matrix.

    Args:
        correlations: input -> metric -> correlation.
        varied: how many of the inputs are keys of `vary`; a line separates them from the rest.
    """
    inputs = shown_inputs(correlations)
    metrics = list(dict.fromkeys(metric for name in inputs for metric in correlations[name]))
    longest = lambda names: _LETTER * max(map(len, names))
    left = longest(inputs) + 0.2
    above = 0.35 + 0.9 * longest(metrics)
    wide = max(0.36 * len(metrics), 2.0)
    tall = 0.24 * len(inputs)
    figure = style.blank(max(left + wide + 0.6, 6.0), above + tall + 0.15)
    style.head(figure, "Rank correlation of metrics with inputs", {})
    panel = style.place(figure, left, above, wide, tall)
    field = np.array([[correlations[name].get(metric, np.nan) for metric in metrics] for name in inputs])
    panel.imshow(field, cmap="RdBu_r", vmin=-1, vmax=1, aspect="auto")
    for row, column in np.ndindex(*field.shape):
        if np.isfinite(number := field[row, column]):
            ink = "white" if abs(number) > _DARK else "black"
            label = f"{number:+.2f}".replace("-", "\u2212") if abs(number) >= _HUNDREDTH else "0.00"
            panel.text(column, row, label, ha="center", va="center", fontsize=style.TINY, color=ink)
    if 0 < varied < len(inputs):
        panel.axhline(varied - 0.5, color=style.INK, linewidth=1.2)
    panel.xaxis.tick_top()
    words = [metric.replace("_", " ") for metric in metrics]
    panel.set_xticks(range(len(metrics)), words, fontsize=style.SMALL, rotation=60, ha="left", rotation_mode="anchor")
    panel.set_yticks(range(len(inputs)), inputs, fontsize=style.SMALL)
    panel.grid(visible=False)
    return figure
