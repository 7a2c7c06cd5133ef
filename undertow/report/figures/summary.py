"""The first picture of a run: where the vehicle went, how far off it was, and what its inputs gave."""

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from undertow.report.figures import recorded, style
from undertow.report.figures.fault_marks import fault_marks
from undertow.report.figures.limits import fit_from_zero, fit_linear
from undertow.report.figures.multiples import mark_times
from undertow.report.plotted import ERRORS, FLOORS, LEAST_PATH, Shown

_WIDTH, _HEIGHT, _PATH = 9.6, 4.1, 3.9  # in
_LEFT, _TOP, _FOOT, _BETWEEN = 0.62, 0.55, 0.42, 0.34
_LIMIT = style.Look("#b3402a", (0, (5, 2)), 0.9, 2)


def summary(shown: Shown, title: str) -> Figure:
    """Path (or the first output), error of each kind of output beside its limit, and the largest input."""
    run = recorded.in_degrees(shown.series)
    figure = style.blank(_WIDTH, _HEIGHT)
    keys = {"desired": style.TRUTH, "actual": style.SOLID}
    units = run["axis"].attrs["unit_of_each"].split(", ")
    errors = [unit for unit in ERRORS if unit in units]
    if shown.criterion or shown.supply:
        keys["limit"] = _LIMIT
    style.head(figure, title, keys)
    tall = _HEIGHT - _TOP - _FOOT
    _path(style.place(figure, _LEFT, _TOP, _PATH - _LEFT, tall), run, (_PATH - _LEFT, tall))
    rows = len(errors) + 1
    height = (tall - _BETWEEN * (rows - 1)) / rows
    left = _PATH + 0.75
    panels = [
        style.place(figure, left, _TOP + row * (height + _BETWEEN), _WIDTH - left - 0.12, height) for row in range(rows)
    ]
    for panel, unit in zip(panels, errors, strict=False):
        _error(panel, run, [place for place, other in enumerate(units) if other == unit], unit, shown)
    _effort(panels[-1], run, shown)
    marks = fault_marks(run, shown.faults)
    for number, panel in enumerate(panels):
        mark_times(panel, marks, named=not number)
    for panel in panels[:-1]:
        panel.tick_params(labelbottom=False)
    return figure


def _path(panel: Axes, run: xr.Dataset, size: tuple[float, float]) -> None:
    """The way on a map with north up; of another plant the first output over time."""
    names = [str(name) for name in run["axis"].values]
    looks = {"reference": style.TRUTH, "position": style.SOLID}
    if not {"north", "east"} <= set(names):
        series = []
        for signal, look in looks.items():
            curve = recorded.curve(run, signal, signal, look)
            panel.plot(curve.time, curve.values[:, 0], **look.line)
            series.append((signal, curve.time, curve.values[:, 0]))
        style.label(panel, "time, s", recorded.places(run)[0], names[0])
        fit_linear(panel, series, 0.0, FLOORS.get(run["axis"].attrs["unit_of_each"].split(", ")[0], 0.0))
        return
    north, east = names.index("north"), names.index("east")
    values = []
    for signal, look in looks.items():
        curve = recorded.curve(run, signal, signal, look).values[:, [east, north]]
        curve = np.where(np.isfinite(curve), curve, np.nan)
        panel.plot(*curve.T, **look.line)
        values.append(curve)
    panel.plot(*values[1][:1].T, marker="o", color=style.INK, markersize=4, zorder=5)
    panel.plot(*values[1][-1:].T, marker="s", color=style.SOLID.colour, markersize=5, zorder=5)
    style.label(panel, "east, m", "north, m", "path from the dot to the square")
    _square(panel, np.concatenate(values), size)


def _square(panel: Axes, points: np.ndarray, size: tuple[float, float]) -> None:
    """Equal scales in a panel of that size, in, at least some decimetres wide."""
    low, high = np.nanmin(points, axis=0), np.nanmax(points, axis=0)
    width, height = size
    span = 1.1 * max((high[0] - low[0]) / width, (high[1] - low[1]) / height, LEAST_PATH / min(width, height))
    middle = (low + high) / 2
    panel.set_xlim(middle[0] - span * width / 2, middle[0] + span * width / 2)
    panel.set_ylim(middle[1] - span * height / 2, middle[1] + span * height / 2)


def _error(panel: Axes, run: xr.Dataset, places: list[int], unit: str, shown: Shown) -> None:
    """The error of all outputs of a unit, rms of these axes, at each instant."""
    curve = recorded.curve(run, "error", "error", style.SOLID)
    size = np.sqrt((curve.values[:, places] ** 2).mean(1))
    panel.plot(curve.time, size, **style.SOLID.line)
    words, key = ERRORS[unit]
    limit = shown.criterion.get(key)
    limit = limit if limit is None or unit == "m" else float(np.degrees(limit))
    _over_time(panel, curve.time, size, limit, FLOORS[unit], run)
    style.label(panel, "", words)


def _effort(panel: Axes, run: xr.Dataset, shown: Shown) -> None:
    """The largest of all inputs at each instant."""
    curve = recorded.curve(run, "input", "input", style.SOLID)
    size = np.abs(curve.values).max(1)
    panel.plot(curve.time, size, **style.SOLID.line)
    _over_time(panel, curve.time, size, shown.supply, 0.0, run)
    unit = run["input"].attrs["units"]
    style.label(panel, "time, s", "largest input" if unit == "1" else f"largest input, {unit}")


def _over_time(
    panel: Axes, time: np.ndarray, size: np.ndarray, limit: float | None, floor: float, run: xr.Dataset
) -> None:
    if limit is not None:
        panel.axhline(limit, **_LIMIT.line)
    fit_from_zero(panel, [("", time, size)], recorded.settled(run), max(floor, 1.15 * (limit or 0.0)))
    if len(time) > 1:
        panel.set_xlim(time[0], time[-1])
