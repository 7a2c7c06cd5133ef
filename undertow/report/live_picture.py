"""The first picture of a run as SVG, made in a few milliseconds: for a slider that moves.

It shows what `figures/summary.py` shows, without Matplotlib, which takes a tenth of a second for it.
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from undertow.report.page import Html
from undertow.report.plotted import ERRORS, FLOORS, LEAST_PATH, Shown
from undertow.report.svg import BLUE, GREY, RED, picture, polyline, words
from undertow.scenario.results.run_result import RunRecord

_WIDTH, _HEIGHT = 960, 380
_PATH, _LEFT, _FOOT, _GAP = 360, 56, 34, 30  # pixels
_POINTS = 400  # of a curve; more are not seen
_IN_DEGREES = {"rad": ("deg", 180 / np.pi)}  # unit of outputs -> unit that is shown, and factor


class _Panel(NamedTuple):
    """A panel and its scale: pixels of the left upper corner, size, and the values at its edges."""

    left: float
    top: float
    width: float
    height: float
    across: tuple[float, float]
    up: tuple[float, float]

    def line(self, x: np.ndarray, y: np.ndarray, colour: str, dashed: bool = False) -> Html:
        """A curve; what is not finite is left out, what is far outside is cut off."""
        (left, right), (low, high) = self.across, self.up
        known = np.isfinite(x) & np.isfinite(y)
        across = self.left + self.width * (x[known] - left) / (right - left)
        up = self.top + self.height * np.clip((high - y[known]) / (high - low), -1, 2)
        return polyline(list(zip(across.tolist(), up.tolist(), strict=True)), colour, dashed)


def live_picture(run: RunRecord, shown: Shown) -> Html:
    """Path on a map, errors beside their limits, and the largest input beside the supply, as one SVG element."""
    series = run.series
    every = max(1, -(-len(series["time"]) // _POINTS))
    values = {name: series[name].values[::every] for name in ("time", "position", "reference", "error", "input")}
    names, units = [str(name) for name in series["axis"].values], series["axis"].attrs["unit_of_each"].split(", ")
    curves = _errors(values["error"], units, shown)
    unit_of_input = series["input"].attrs["units"].removesuffix("1")
    effort = f"largest input{f', {unit_of_input}' if unit_of_input else ''}"
    curves.append((effort, np.abs(values["input"]).max(1), shown.supply, 0.0))
    parts = [*_path(values, names)]
    height = (_HEIGHT - _FOOT - _GAP * len(curves)) / len(curves)
    for row, curve in enumerate(curves):
        parts += _over_time(values["time"], *curve, top=_GAP + row * (height + _GAP), height=height)
    parts.append(words(_PATH + _LEFT, _HEIGHT - 6, f"time, 0 to {values['time'][-1]:g} s"))
    return picture(_WIDTH, _HEIGHT, *parts)


def _errors(error: np.ndarray, units: Sequence[str], shown: Shown) -> list[tuple[str, np.ndarray, float | None, float]]:
    """For the outputs of each kind: title, error at each instant (rms of these axes), its limit, and the least span."""
    curves = []
    for unit in dict.fromkeys(units):
        displayed, factor = _IN_DEGREES.get(unit, (unit, 1.0))
        if displayed not in ERRORS:
            continue
        title, metric = ERRORS[displayed]
        axes = [place for place, other in enumerate(units) if other == unit]
        limit = None if metric not in shown.criterion else factor * shown.criterion[metric]
        curves.append((title, factor * np.sqrt((error[:, axes] ** 2).mean(1)), limit, FLOORS[displayed]))
    return curves


def _path(values: dict[str, np.ndarray], names: Sequence[str]) -> list[Html]:
    """The way on a map with north up; of another plant the first output over time."""
    box = (_LEFT, _GAP, _PATH - _LEFT - 20, _HEIGHT - _FOOT - _GAP)
    if {"north", "east"} <= set(names):
        east, north = names.index("east"), names.index("north")
        ways = [(values[signal][:, east], values[signal][:, north]) for signal in ("reference", "position")]
        heading, foot = "north, m", "east, m"
        spans = _square(np.concatenate([np.stack(way, 1) for way in ways]), box[2] / box[3])
    else:
        ways = [(values["time"], values[signal][:, 0]) for signal in ("reference", "position")]
        heading, foot = names[0], ""
        both = np.concatenate([way[1][np.isfinite(way[1])] for way in ways])
        margin = max(0.05 * float(np.ptp(both)), 1e-2)
        end = max(float(values["time"][-1]), 1e-9)
        spans = (0.0, end), (float(both.min()) - margin, float(both.max()) + margin)
    panel = _Panel(*box, *spans)
    lines = [panel.line(*way, colour) for way, colour in zip(ways, (GREY, BLUE), strict=True)]
    return [*_frame(panel, heading), *lines, words(panel.left, _HEIGHT - 6, f"{foot}; grey: desired".lstrip("; "))]


def _square(points: np.ndarray, shape: float) -> tuple[tuple[float, float], tuple[float, float]]:
    """Equal scales that hold all points in a panel of that width per height."""
    known = points[np.isfinite(points).all(1)]
    low, high = known.min(0), known.max(0)
    middle = (low + high) / 2
    half = 0.55 * max((high[0] - low[0]) / shape, high[1] - low[1], LEAST_PATH)
    (east, north) = middle.tolist()
    return (east - half * shape, east + half * shape), (north - half, north + half)


def _over_time(
    time: np.ndarray, heading: str, size: np.ndarray, limit: float | None, floor: float, top: float, height: float
) -> list[Html]:
    """One curve from zero upwards, beside its limit."""
    settled = size[len(size) // 10 :]
    finite = settled[np.isfinite(settled)]
    most = max(1.1 * float(finite.max()) if finite.size else 0.0, floor, 1.15 * (limit or 0.0), 1e-12)
    end = max(float(time[-1]), 1e-9)
    panel = _Panel(_PATH + _LEFT, top, _WIDTH - _PATH - _LEFT - 10, height, (0.0, end), (0.0, most))
    parts = [*_frame(panel, heading), panel.line(time, size, BLUE)]
    if limit is not None:
        parts.append(panel.line(np.array([0.0, end]), np.array([limit, limit]), RED, dashed=True))
    return parts


def _frame(panel: _Panel, heading: str) -> list[Html]:
    """Axes, their extreme values, and what is shown."""
    left, top, width, height, _, (low, high) = panel
    frame = Html(f'<rect x="{left}" y="{top:.1f}" width="{width}" height="{height:.1f}" fill="none" stroke="#ccc"/>')
    ends = [words(left - 6, top + 9, f"{high:.3g}", "end"), words(left - 6, top + height, f"{low:.3g}", "end")]
    return [frame, words(left, top - 8, heading), *ends]
