"""Tables, figures and page of a board whose numbers are known."""

import math
from pathlib import Path

import numpy as np
import pytest
from matplotlib.backends.backend_agg import FigureCanvasAgg

from undertow.report.arena_page import write_board
from undertow.report.figures.arena import robustness_figure, tasks_figure
from undertow.studies.arena.entry import Entry
from undertow.studies.arena.leader_board import (
    Board,
    Standing,
    as_csv,
    failures,
    leader_rows,
    margin_rows,
    ranked,
    ratio_rows,
    task_rows,
)
from undertow.studies.arena.robustness import PARAMETERS, RobustnessCurve
from undertow.studies.arena.scores import CellResult, scored
from undertow.studies.arena.tasks import CELLS as EVERY
from undertow.studies.arena.tasks import TASKS
from undertow.studies.comparison.step_time import StepTime

CELLS = (("payload", "odin"), ("payload", "rexrov"), ("delay", "odin"))


def standing(name: str, errors: tuple[float, ...], levels: int, each=CELLS) -> Standing:
    """A law with these errors, within the tolerance up to so many levels of every parameter and lost after them."""
    cells = {}
    for cell, error in zip(each, errors, strict=True):
        found = np.full(3, error)
        failed = {"diverged": 3} if error == 10 else {}
        tracking = np.full(3, np.nan) if failed else 0.5 * found
        cells[cell] = CellResult(found, tracking, tracking, np.full(3, 0.5), failed)
    curves = {}
    for key, one in PARAMETERS.items():
        high = np.where(np.arange(len(one.levels)) < levels, 0.5, 10.0)
        curves[key] = RobustnessCurve(one.levels, high, high, high)
    entry = Entry(name, 1, {"kind": name}, each, {}, {"odin": "tuned <by hand>"})
    return Standing(entry, scored(name, cells), curves, StepTime(2e-6, "xla"))


@pytest.fixture
def board():
    return Board((standing("robust", (0.1, 0.4, 0.2), 3), standing("pid", (0.2, 0.2, 10.0), 0)), CELLS)


def test_tables(board):
    first, second = leader_rows(board).rows
    assert first[0] == "robust" and first[1].startswith("0.2 [0.2, 0.2]") and first[4] == "1"
    assert first[6] == "2 (XLA)" and second[3] == "33.3 %"
    assert task_rows(board).rows[0] == ("robust", "0.2", "0.2")  # sqrt(0.1 * 0.4)
    assert ratio_rows(board).rows[1] == ("pid", "1", "50", "50")  # sqrt(2 * 0.5), 10 / 0.2
    assert ratio_rows(Board(board.standings[1:], CELLS)).rows == []
    assert failures(board).rows == [("pid", "delay", "odin", "diverged 3")]
    levels = next(iter(PARAMETERS.values())).levels
    assert margin_rows(board).rows[0][1] == f"{levels[2]:g}" and set(margin_rows(board).rows[1][1:]) == {"none"}
    lines = as_csv(board).splitlines()
    assert lines[0].startswith("law,task,vehicle,error") and lines[1] == "robust,payload,odin,0.1,0.05,0.05,0.5,0,3"
    assert lines[-1] == "pid,delay,odin,10.0,,,0.5,3,3"


def test_rank_is_by_lost_trials_and_then_by_error():
    good, bad = standing("good", (0.2, 0.2, 0.2), 3), standing("bad", (0.3, 0.3, 0.3), 3)
    loses = standing("loses", (0.01, 0.01, 10.0), 3)
    assert loses.score.error < good.score.error
    assert [one.score.name for one in ranked([bad, loses, good])] == ["good", "bad", "loses"]


@pytest.mark.full
def test_figures_show_the_numbers(board):
    texts = {text.get_text() for text in tasks_figure(board).axes[0].texts}
    assert texts == {"0.20", "10"}
    panels = robustness_figure(board.standings).axes
    assert len(panels) == len(PARAMETERS)
    for panel, parameter in zip(panels, PARAMETERS.values(), strict=True):
        crosses = [line.get_xdata()[0] for line in panel.lines if line.get_marker() == "x"]
        assert crosses == [parameter.levels[0], parameter.levels[3]]  # where pid, and where robust is lost first


@pytest.mark.full
def test_all_tasks_and_their_names_are_on_the_figure():
    every = Board((standing("adaptive_backstepping", (0.1,) * len(EVERY), 0, EVERY),), EVERY)
    figure = tasks_figure(every)
    width, _ = FigureCanvasAgg(figure).get_width_height()
    names = figure.axes[0].get_xticklabels()
    assert len(names) == len(TASKS)
    assert max(name.get_window_extent().x1 for name in names) < width


@pytest.mark.full
def test_page(board, tmp_path):
    page, failed = write_board(board, tmp_path)
    text = page.read_text()
    assert not failed and {path.name for path in (tmp_path / "figures").glob("*.svg")} == {
        "tasks.svg",
        "robustness.svg",
    }
    assert "2 laws, 2 tasks, 2 vehicles, 3 pairs of them, 3 trials" in text
    assert "tuned &lt;by hand&gt;" in text and "Failed trials" in text
    assert page == Path(tmp_path / "leaderboard.html") and not math.isnan(board.standings[0].score.low)
