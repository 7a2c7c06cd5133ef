"""Figures of the arena: errors of all laws in all tasks, and errors over every parameter until a law fails."""

import math
from collections.abc import Callable, Mapping, Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import LogNorm
from matplotlib.figure import Figure

from undertow.core.number_text import plain
from undertow.report.figures import style
from undertow.report.figures.campaign import looks_of
from undertow.studies.arena.leader_board import Board, Standing
from undertow.studies.arena.robustness import PARAMETERS
from undertow.studies.arena.scores import FINEST, LOST

_SHOWN = 6  # laws with a colour in the charts of robustness; the others are grey
_COLUMNS, _WIDTH, _HEIGHT = 3, 2.6, 1.75  # panels, in
_PAGE, _NARROWEST = 9.6, 5.6  # widths of the figure of the tasks: of all of them, and that of its title, in
_SLANTED = 0.85  # of the name of the last task, beside its cell, in


def arena_plots(board: Board) -> Mapping[str, Callable[[], Figure]]:
    """The figures of a board by name."""
    plots: dict[str, Callable[[], Figure]] = {"tasks": lambda: tasks_figure(board)}
    standings = [standing for standing in board.standings if standing.robustness]
    return plots | ({"robustness": lambda: robustness_figure(standings)} if standings else {})


def tasks_figure(board: Board) -> Figure:
    """A cell for every law and task, its colour and number the error in tolerances."""
    laws = [standing.entry.name for standing in board.standings]
    tasks = board.tasks
    errors = np.array([[standing.score.mean(board.of_task(task)) for task in tasks] for standing in board.standings])
    left = 0.25 + 0.075 * max(map(len, laws))
    top = 1.35
    cell = (min(0.6, (_PAGE - left - _SLANTED) / len(tasks)), 0.24)
    width = min(_PAGE, max(_NARROWEST, left + cell[0] * len(tasks) + _SLANTED))
    figure = style.blank(width, top + cell[1] * len(laws) + 0.2)
    style.head(figure, "Error / tolerance by task (geometric mean over the vehicles)", {})
    panel = style.place(figure, left, top, cell[0] * len(tasks), cell[1] * len(laws))
    panel.imshow(errors, norm=LogNorm(FINEST, LOST), cmap="RdYlBu_r", aspect="auto")
    panel.grid(False)
    panel.xaxis.tick_top()
    words = [task.replace("_", " ") for task in tasks]
    panel.set_xticks(range(len(tasks)), words, rotation=40, ha="left", fontsize=style.SMALL)
    panel.set_yticks(range(len(laws)), laws, fontsize=style.SMALL)
    for (row, column), error in np.ndenumerate(errors):
        extreme = error > 3 or error < 0.03  # the dark ends of the colours
        colour = "white" if extreme else style.INK
        panel.text(column, row, plain(float(error), 2), ha="center", va="center", fontsize=style.TINY, color=colour)
    return figure


def robustness_figure(standings: Sequence[Standing]) -> Figure:
    """A panel for every parameter: the error over its levels; a line ends with a cross where a law is lost."""
    rows = math.ceil(len(PARAMETERS) / _COLUMNS)
    looks = looks_of([standing.entry.name for standing in standings[:_SHOWN]])
    grey = {"others": style.Look("#b5b5b5", "-", 0.7, 1)} if len(standings) > _SHOWN else {}
    figure = style.blank(0.7 + _COLUMNS * (_WIDTH + 0.55), 0.85 + rows * (_HEIGHT + 0.65))
    style.head(figure, "Error / tolerance over one parameter after the other", {})
    style.key(figure, looks | grey, 0.3, 7)
    for number, (name, parameter) in enumerate(PARAMETERS.items()):
        row, column = divmod(number, _COLUMNS)
        left, top = 0.6 + column * (_WIDTH + 0.55), 0.85 + row * (_HEIGHT + 0.65)
        panel = style.place(figure, left, top, _WIDTH, _HEIGHT)
        for standing in reversed(standings):
            look = looks.get(standing.entry.name, grey.get("others"))
            if look is not None:
                _line(panel, standing, name, look)
        panel.set_yscale("log")
        panel.set_ylim(FINEST * 0.8, LOST * 1.4)
        levels = np.array(parameter.levels)
        if levels.max() > 5 * levels.min():
            panel.set_xscale("log")
        if levels[0] > levels[-1]:
            panel.invert_xaxis()
        ticks = list(parameter.levels[:: 2 if len(levels) > 5 else 1])
        panel.set_xticks(ticks, [f"{tick:g}" for tick in ticks])
        panel.xaxis.minorticks_off()
        panel.axhline(1.0, color=style.INK, linewidth=0.8, linestyle=(0, (1, 1.8)))
        style.label(panel, parameter.label, "error / tolerance" if column == 0 else "")
    return figure


def _line(panel: Axes, standing: Standing, name: str, look: style.Look) -> None:
    """Median errors up to the first level at which a trial is lost."""
    curve = standing.robustness[name]
    lost = np.flatnonzero(curve.high >= LOST)
    end = int(lost[0]) if len(lost) else len(curve.levels)
    levels = np.array(curve.levels)
    errors = np.where(np.arange(len(curve.levels)) < end, curve.middle, LOST)
    panel.plot(levels[: end + 1], errors[: end + 1], **look.line)
    if end < len(levels):
        panel.plot(levels[end], LOST, "x", color=look.colour, markersize=5, zorder=look.order)
