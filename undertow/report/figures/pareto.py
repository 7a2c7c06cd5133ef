"""Figure: Pareto fronts of a comparison, error against effort, with the name of every candidate."""

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from undertow.analysis.metrics import titled_name
from undertow.core.number_text import display_units
from undertow.report.figures import style
from undertow.report.figures.campaign import looks_of
from undertow.studies.comparison.findings import Findings
from undertow.studies.comparison.pareto import Front

_COLUMNS, _PALE, _PALE_NAME = 2, 0.3, 0.55
_MIDDLE = 0.5  # of a panel
_WIDE = 30.0  # ratio of largest and smallest from which on an axis is logarithmic
_WIDTH, _HEIGHT = 4.0, 2.4  # of a panel, in


def pareto_figure(findings: Findings) -> Figure:
    """Medians with their 95 % intervals; dominated ones pale, those with failed trials hollow."""
    rows = -(-len(findings.fronts) // _COLUMNS)
    figure = style.blank(9.6, 0.45 + rows * (_HEIGHT + 0.6))
    style.head(figure, "Pareto fronts: median error against median effort", {})
    for number, front in enumerate(findings.fronts):
        row, column = divmod(number, _COLUMNS)
        panel = style.place(figure, 0.62 + 4.75 * column, 0.5 + row * (_HEIGHT + 0.6), _WIDTH, _HEIGHT)
        _plot(panel, findings, front)
    return figure


def _plot(panel: Axes, findings: Findings, front: Front) -> None:
    scales = [display_units(1.0, findings.units[metric]) for metric in (front.effort, front.error)]
    scaled_medians = lambda name, metric, scale: scale * np.array(findings.medians[metric][name][:3])
    for name, look in looks_of(findings.names).items():
        if name not in front.points:
            continue
        x, *x_interval = scaled_medians(name, front.effort, scales[0][0])
        y, *y_interval = scaled_medians(name, front.error, scales[1][0])
        strong = name in front.front
        alpha = 1.0 if strong else _PALE
        fill = "white" if name in front.incomplete else look.colour
        panel.plot(x_interval, [y, y], color=look.colour, alpha=alpha, linewidth=1.2)
        panel.plot([x, x], y_interval, color=look.colour, alpha=alpha, linewidth=1.2)
        panel.plot(x, y, "o", color=look.colour, markerfacecolor=fill, alpha=alpha, markersize=5)
    steps = np.array([front.points[name] for name in front.front]).reshape(-1, 2)
    panel.step(scales[0][0] * steps[:, 1], scales[1][0] * steps[:, 0], where="pre", color=style.INK, linewidth=0.7)
    for axis, values in ((panel.set_xscale, 1), (panel.set_yscale, 0)):
        column = np.array([point[values] for point in front.points.values()])
        if column.min() > 0 and column.max() > _WIDE * column.min():
            axis("log")
    panel.margins(0.14)
    _name_points(panel, front, scales[0][0], scales[1][0])
    words = lambda metric, unit: ", ".join([titled_name(metric), *([style.power(unit)] if unit else [])])
    style.label(panel, words(front.effort, scales[0][1]), words(front.error, scales[1][1]))


def _name_points(panel: Axes, front: Front, effort_scale: float, error_scale: float) -> None:
    """Names beside the points, to the left of those in the right half, where a long one would be cut off."""
    panel.autoscale_view()
    to_axes = panel.transData + panel.transAxes.inverted()
    for name, (error, effort) in front.points.items():
        at = (effort_scale * effort, error_scale * error)
        strong = name in front.front
        leftwards = to_axes.transform(at)[0] > _MIDDLE
        panel.annotate(
            name,
            at,
            xytext=(-4 if leftwards else 4, 4),
            textcoords="offset points",
            horizontalalignment="right" if leftwards else "left",
            fontsize=style.SMALL,
            color=style.INK,
            alpha=1.0 if strong else _PALE_NAME,
            fontweight="bold" if strong else "normal",
        )
