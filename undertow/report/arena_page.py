"""The page of the arena: leader board, tasks, robustness, failures, and how every law was tuned."""

import math
import re
from pathlib import Path

from undertow.core.atomic_io import write_whole
from undertow.report.answers.arena_answer import answer_of_board
from undertow.report.answers.plain_answer import answer_block
from undertow.report.figures.arena import arena_plots
from undertow.report.figures.writing import save_all
from undertow.report.formats import captioned, prose
from undertow.report.page import Html, bullets, document, section, table, tag
from undertow.studies.arena.leader_board import (
    BASELINE,
    Board,
    failures,
    leader_rows,
    margin_rows,
    ratio_rows,
    task_rows,
    vehicle_rows,
)
from undertow.studies.arena.robustness import VEHICLE
from undertow.studies.arena.tasks import TASKS, VERSION, tolerances
from undertow.studies.comparison.step_time import HOW_LONG
from undertow.studies.comparison.tables import TextTable

PAGE = "leaderboard.html"

SCORE = (
    "The error of a trial is the root of the mean square of position error (rms per axis) and orientation error (rms "
    "angle), each divided by its tolerance; it counts from 0.01 to 10, and a run that failed as 10. The score is the "
    "geometric mean, over tasks and vehicles, of the median over the trials, with its 95 % interval from resampling "
    "them. Laws that lose fewer vehicles come first. Within tolerance: trials with both errors below their "
    "tolerances. Lost: trials that failed or had ten times the tolerance; in both, every task on every vehicle counts "
    "the same. Input variation: total variation of the inputs per second as a share of their limit."
)
_CAPTIONS = {
    "tasks": "Error of every law in every task, in tolerances; the geometric mean over the vehicles of the median over "
    "the trials. Blue is far below the tolerance, red is lost.",
    "robustness": f"Vehicle {VEHICLE} follows the motion of the tasks in a current, while one parameter at a time "
    "takes harder levels. Lines are medians of the trials, in tolerances; a cross marks the first level at which a "
    "trial is lost. The best six laws have a colour.",
}
_MARGINS = (
    "The hardest level up to which all trials were within the tolerance at every level; + where that is the last level "
    "that was tried."
)


def write_board(board: Board, folder: Path, pdf: str | None = None) -> tuple[Path, list[str]]:
    """Write `leaderboard.html`, and every figure into `figures/`; return a sentence for each figure that failed.

    Args:
        board: the laws.
        folder: of the page.
        pdf: width of PDF files; None for none.

    Raises:
        OSError: the folder cannot be written.
    """
    saved = save_all(lambda: arena_plots(board), folder / "figures", pdf)
    pictures = captioned(saved.vectors, _CAPTIONS)
    title = f"Arena, version {VERSION}"
    trials = max(len(result.errors) for standing in board.standings for result in standing.score.cells.values())
    lead = (
        f"{len(board.standings)} laws, {len(board.tasks)} tasks, {len(board.vehicles)} vehicles, {len(board.cells)} "
        f"pairs of them, {trials} {'trial' if trials == 1 else 'trials'} of each with the same seeds for all laws."
    )
    margins, failed, ratios = margin_rows(board), failures(board), ratio_rows(board)
    path = folder / PAGE
    write_whole(
        path,
        document(
            title,
            tag("h1", prose(title)),
            tag("p", prose(lead), class_="lead"),
            answer_block(answer_of_board(board)),
            *(tag("p", prose(sentence)) for sentence in saved.failures),
            *_shown(pictures, "tasks"),
            _rows(leader_rows(board)),
            tag("p", prose(f"{SCORE} {HOW_LONG}"), class_="small"),
            section("tasks", "Errors by task", _rows(task_rows(board))),
            *([_ratios(ratios)] if ratios.rows else []),
            section("vehicles", "Errors by vehicle", _rows(vehicle_rows(board))),
            *([_robustness(pictures, margins)] if margins.rows else []),
            *([section("failures", "Failed trials", _rows(failed, words=3))] if failed.rows else []),
            section("gains", "Gains", _gains(board)),
            section("definition", "Tasks and tolerances", _definition(board)),
        ),
    )
    return path, saved.failures


def _ratios(ratios: TextTable) -> Html:
    explanation = (
        f"Error / that of preset `{BASELINE}`: the geometric mean over the vehicles; below 1 the law is better."
    )
    return section("ratios", f"Errors against {BASELINE}", _rows(ratios), tag("p", prose(explanation), class_="small"))


def _robustness(pictures: dict[str, Html], margins: TextTable) -> Html:
    explained = tag("p", prose(_MARGINS), class_="small")
    return section("robustness", "Robustness", *_shown(pictures, "robustness"), _rows(margins), explained)


def _shown(pictures: dict[str, Html], name: str) -> list[Html]:
    return [pictures[name]] if name in pictures else []


def _rows(rows: TextTable, words: int = 1) -> Html:
    """A table; its first columns hold words, the others numbers."""
    cells = [tuple(prose(cell) for cell in row) for row in rows.rows]
    head = [prose(re.sub(r"\(us\)", "(\u00b5s)", title)) for title in rows.head]
    return table(head, cells, numeric=range(words, len(rows.head)), wide=len(rows.head) > 4)


def _gains(board: Board) -> Html:
    """How the gains of each law came about."""
    items = []
    for standing in board.standings:
        sentences = [f"{vehicle}: {sentence}" for vehicle, sentence in standing.entry.gains.items()]
        description = ". ".join(sentences) if sentences else "as the law has them by itself"
        items.append(prose(f"{standing.entry.name}: {description}."))
    return bullets(items)


def _definition(board: Board) -> Html:
    """The tasks in words, with the tolerances for each vehicle."""
    rows = []
    for task in board.tasks:
        cells = []
        for vehicle in board.vehicles:
            if (task, vehicle) not in board.cells:
                cells.append("-")
                continue
            position, orientation = tolerances(task, vehicle)
            cells.append(f"{position:g} m, {math.degrees(orientation):.0f} deg")
        rows.append((task.replace("_", " "), prose(TASKS[task].question), *cells))
    return table(("task", "question", *board.vehicles), rows, wide=True)
