"""Ablations as dots and intervals: one small panel per question, one row per variant."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from undertow.paper.ablations.study import unit_of
from undertow.report.figures import style

_COLUMNS, _ROW, _ABOVE, _BELOW = 3, 0.135, 0.3, 0.24  # in
_WIDTH, _LABELS, _PANEL = 3.16, 1.38, 1.62  # in

_BEST, _OTHER, _LOST = "#0072b2", "#555555", "#b3402a"

Ablation = Mapping[str, Any]


def ablations_figure(ablations: Sequence[Ablation]) -> Figure:
    """Median, its 95 % interval (thick) and 5 to 95 % of the seeds (thin) of the first metric of each ablation.

    Args:
        ablations: `id` and `variants`, each with `name`, `failures`, `seeds` and `metrics`.
    """
    columns = _packed(ablations)
    tall = max((sum(_height(ablation) for ablation in column) for column in columns), default=0.5)
    figure = style.blank(9.6, 0.35 + tall)
    style.head(figure, "Ablations: the metric named above each panel, over the seeds", {})
    for number, column in enumerate(columns):
        top = 0.35
        for ablation in column:
            rows = len(ablation["variants"])
            panel = style.place(figure, number * _WIDTH + _LABELS + 0.12, top + _ABOVE, _PANEL, _ROW * rows)
            _panel(panel, ablation)
            top += _height(ablation)
    return figure


def _height(ablation: Ablation) -> float:
    return _ABOVE + _ROW * len(ablation["variants"]) + _BELOW


def _packed(ablations: Sequence[Ablation]) -> list[list[Ablation]]:
    """In reading order down the columns, about equally tall."""
    total_height = sum(map(_height, ablations))
    columns: list[list[Ablation]] = [[] for _ in range(_COLUMNS)]
    passed = 0.0
    for ablation in ablations:
        middle = passed + _height(ablation) / 2
        columns[min(int(_COLUMNS * middle / total_height), _COLUMNS - 1)].append(ablation)
        passed += _height(ablation)
    return columns


def _panel(panel: Axes, ablation: Ablation) -> None:
    metric = next(iter(ablation["variants"][0]["metrics"]))
    panel.set_xscale("log")
    for row, variant in enumerate(ablation["variants"]):
        spread = variant["metrics"][metric]
        median = spread["median"]
        if not np.isfinite(median) or median <= 0:
            lost = variant["failures"] > 0
            colour, mark = (_LOST, "X") if lost else (_OTHER, "<")
            at = 0.97 if lost else 0.02
            panel.plot(at, row, mark, transform=panel.get_yaxis_transform(), color=colour, markersize=4.5)
            continue
        thin = [max(spread["low"], 1e-12), _finite(spread["high"], median)]
        thick = [max(spread["median_low"], 1e-12), _finite(spread["median_high"], median)]
        panel.plot(thin, [row, row], color=_OTHER, linewidth=0.7, zorder=2)
        panel.plot(thick, [row, row], color=_BEST, linewidth=2.2, zorder=3)
        panel.plot(median, row, "o", color=_BEST, markersize=3.2, zorder=4)
        if variant["failures"]:
            panel.plot(0.97, row, "X", transform=panel.get_yaxis_transform(), color=_LOST, markersize=3.5)
    low, high = panel.get_xlim()
    panel.set_xlim(low / 1.5, high * 1.5)
    style.few_log_ticks(panel.xaxis, most=4)
    names = [variant["name"] for variant in ablation["variants"]]
    panel.set_yticks(range(len(names)), names, fontsize=style.TINY - 1)
    panel.set_ylim(len(names) - 0.5, -0.5)
    panel.tick_params(axis="x", labelsize=style.TINY)
    title = f"{ablation['id']}  {metric.replace('_', ' ')}, {style.power(unit_of(metric))}".removesuffix(", ")
    panel.set_title(title, fontsize=style.TINY + 0.5, loc="left", y=1, pad=2)


def _finite(value: float, instead: float) -> float:
    return value if np.isfinite(value) else instead
