"""Figure of an identified thruster: points of the bench and the curve, errors, current, and thrust after a step."""

from collections.abc import Mapping

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from undertow.report.figures import style
from undertow.studies.identification.bench.bench_fit import JudgedFit
from undertow.studies.identification.bench.bench_table import BenchTable
from undertow.studies.identification.bench.thruster_form import joined

_WIDTH, _LEFT, _PANEL = 6.4, 0.75, 5.4  # in
_TALL, _LOW, _GAP, _TOP = 2.6, 0.95, 0.5, 0.45  # in
_POINTS = {"linestyle": "none", "marker": "o", "markersize": 2.6, "markeredgewidth": 0, "color": style.MEASURED.colour}
_BEFORE, _AFTER = 1.0, 3.0  # s around a step
_LARGE_STEP = 0.8  # of the largest change of the command


def bench_figure(fit: JudgedFit, others: Mapping[str, np.ndarray], grid: np.ndarray) -> Figure:
    """Points, curve and its interval over the voltage; errors of the rows; a step where there is one.

    Args:
        fit: form of the thruster to show.
        others: thrust of other thrusters at the voltages of `grid`, N, by name; the first is shown.
        grid: voltages, V.
    """
    settled = [table for table in fit.problem.tables if table.time is None]
    records = [table for table in fit.problem.tables if table.time is not None]
    heights = [_TALL, *([_LOW] if settled else []), *([1.5] if records else [])]
    figure = style.blank(_WIDTH, _TOP + sum(heights) + _GAP * len(heights))
    keys = {"bench": style.MEASURED, "identified": style.SOLID}
    keys |= {name: style.DASHED for name in list(others)[:1]}
    style.head(figure, "Thrust on the bench", keys)
    panels, top = [], _TOP
    for height in heights:
        panels.append(style.place(figure, _LEFT, top, _PANEL, height))
        top += height + _GAP
    _curve(panels.pop(0), fit, others, grid, settled)
    if settled:
        _errors(panels.pop(0), fit)
    if records:
        _step(panels.pop(0), fit, records[0])
    return figure


def _curve(
    panel: Axes, fit: JudgedFit, others: Mapping[str, np.ndarray], grid: np.ndarray, settled: list[BenchTable]
) -> None:
    thrust, half = fit.thrust_band(grid)
    for table in settled:
        panel.plot(table.volts, table.thrust, **_POINTS)
    panel.fill_between(grid, thrust - half, thrust + half, color=style.SOLID.colour, alpha=0.18, linewidth=0)
    panel.plot(grid, thrust, **style.SOLID.line)
    for values in list(others.values())[:1]:
        panel.plot(grid, values, **style.DASHED.line)
    panel.set_xlim(float(grid[0]), float(grid[-1]))
    panel.yaxis.set_major_locator(MaxNLocator(7, steps=style.STEPS))
    style.label(panel, "voltage at the motor, V", "thrust, N")


def _errors(panel: Axes, fit: JudgedFit) -> None:
    """Errors of settled rows."""
    volts = joined(fit.problem.tables, "volts")
    settled = np.concatenate([np.full(len(table.volts), table.time is None) for table in fit.problem.tables])
    panel.plot(volts[settled], fit.fit.errors[settled, 0], **_POINTS)
    panel.axhline(0.0, color=style.INK, linewidth=0.6)
    panel.set_xlim(-fit.problem.form.largest if (volts < 0).any() else 0.0, fit.problem.form.largest)
    style.label(panel, "voltage at the motor, V", "error, N")


def _step(panel: Axes, fit: JudgedFit, table: BenchTable) -> None:
    """Thrust around the first large step of a record."""
    assert table.time is not None
    change = np.abs(np.diff(table.volts))
    step = float(table.time[1 + int(np.argmax(change >= _LARGE_STEP * change.max()))])
    shown = (table.time >= step - _BEFORE) & (table.time <= step + _AFTER)
    predicted = np.asarray(fit.problem.predicted(fit.fit.z, table).thrust)
    panel.plot(table.time[shown], table.thrust[shown], **_POINTS)
    panel.plot(table.time[shown], predicted[shown], **style.SOLID.line)
    style.label(panel, "time, s", "thrust, N")
