"""Small multiples: one panel per axis or thruster, with a second panel for details."""

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from undertow.report.figures import style
from undertow.report.figures.limits import fit_from_zero, fit_linear, fit_log, fit_symmetric

WIDTH = 9.6  # in
# Share of a panel that the word of a mark takes, and what hides the curves behind it.
_ROOM, _PAPER = 0.3, {"facecolor": "white", "alpha": 0.85, "linewidth": 0, "pad": 0.6}
_HEAD, _FOOT, _LEFT, _RIGHT, _GAP, _BETWEEN = 0.34, 0.2, 0.56, 0.1, 0.08, 0.24


class Curve(NamedTuple):
    """A signal of several columns, one panel each."""

    name: str
    time: np.ndarray  # s, (samples,)
    values: np.ndarray  # (samples, columns)
    look: style.Look


class Mark(NamedTuple):
    """A vertical line at an instant, in every panel; the first panel has its word beside it, before or after."""

    time: float  # s
    word: str
    dashes: tuple
    before: bool


class Block(NamedTuple):
    """One panel per column."""

    curves: Sequence[Curve]
    quantities: Sequence[str]  # y label per column, with unit
    height: float = 1.15  # in
    width: float = 1.0  # share, where blocks stand beside each other
    scale: str = "linear"  # or log, symlog, zero: linear from zero
    spans: Sequence[float] = ()  # least span of the y axis, per column; none by default
    window: tuple[float, float] | None = None  # s; the whole record by default
    limits_from: float = 0.0  # s; the y axis fits the values after this time
    titled: bool = False  # whether the panel shows the name of the column
    marks: Sequence[Mark] = ()


def small_multiples(
    title: str, names: Sequence[str], blocks: Sequence[Block], columns: int = 3, beside: bool = False
) -> Figure:
    """A grid with one cell per name; the blocks of a cell stand below each other, or beside each other."""
    rows = math.ceil(len(names) / columns)
    heights = [block.height + _above(block) for block in blocks]
    tall = (max(heights) if beside else sum(heights)) + _BETWEEN
    figure = style.blank(WIDTH, _HEAD + rows * tall + _FOOT)
    style.head(figure, title, {curve.name: curve.look for block in blocks for curve in block.curves})
    cell = (WIDTH - _RIGHT) / columns
    shares = np.array([block.width for block in blocks]) / sum(block.width for block in blocks)
    for index, name in enumerate(names):
        row, column = divmod(index, columns)
        left = column * cell
        top = _HEAD + row * tall
        lowest = index + columns >= len(names)
        for number, block in enumerate(blocks):
            width = cell * (shares[number] if beside else 1.0)
            panel = style.place(figure, left + _LEFT, top + _above(block), width - _LEFT - _GAP, block.height)
            timed = lowest and (beside or number == len(blocks) - 1)
            style.label(panel, "time, s" if timed else "", block.quantities[index], name if block.titled else "")
            _plot(panel, block, index)
            panel.tick_params(labelbottom=beside or number == len(blocks) - 1 or block.window != blocks[-1].window)
            left, top = (left + width, top) if beside else (left, top + heights[number])
    return figure


def _above(block: Block) -> float:
    """Space for a title, or for the tick labels of the panel above, in."""
    return 0.24 if block.titled else 0.2


def _plot(panel: Axes, block: Block, column: int) -> None:
    curves_in_window = [_cut(curve, block.window) for curve in block.curves]
    for curve in curves_in_window:
        values = np.where(np.isfinite(curve.values[:, column]), curve.values[:, column], np.nan)
        panel.plot(curve.time, values, **curve.look.line, label=curve.name)
    series = [(curve.name, curve.time, curve.values[:, column]) for curve in curves_in_window]
    least = block.spans[column] if block.spans else 0.0
    fits = {"linear": fit_linear, "log": fit_log, "symlog": fit_symmetric, "zero": fit_from_zero}
    fits[block.scale](panel, series, block.limits_from, least)
    ends = [curve.time[[0, -1]] for curve in curves_in_window if len(curve.time)]
    if ends and np.ptp(ends) > 0:
        panel.set_xlim(min(end[0] for end in ends), max(end[1] for end in ends))
    mark_times(panel, block.marks, named=column == 0)


def mark_times(panel: Axes, marks: Sequence[Mark], named: bool) -> None:
    """A vertical line at each mark, with its word where it is named."""
    for mark in marks:
        panel.axvline(mark.time, color=style.INK, linestyle=mark.dashes, linewidth=0.6, zorder=1.5)
    if marks and named:
        _name(panel, marks)


def _name(panel: Axes, marks: Sequence[Mark]) -> None:
    """Write the words of marks at the upper edge, each in a line of its own, on the side where there is room."""
    left, right = panel.get_xlim()
    for line, mark in enumerate(sorted(marks, key=lambda mark: mark.time)):
        share = (mark.time - left) / (right - left)
        before = share > _ROOM if mark.before else share > 1 - _ROOM
        shift, align = (-2, "right") if before else (2, "left")
        style.note(
            panel, mark.word, (share, 1.0), (shift, -2 - 7.5 * line), ha=align, va="top", color=style.INK, bbox=_PAPER
        )


def _cut(curve: Curve, window: tuple[float, float] | None) -> Curve:
    if window is None:
        return curve
    inside = (curve.time >= window[0]) & (curve.time <= window[1])
    return curve._replace(time=curve.time[inside], values=curve.values[inside])
