"""The leader board: every law with results in the folder of an arena, best first."""

import csv
import io
import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from undertow.core.errors import BadInput
from undertow.studies.arena.entry import ENTRY, LAWS, Cell, Entry, read_entry
from undertow.studies.arena.robustness import FOLDER, PARAMETERS, RobustnessCurve, curves
from undertow.studies.arena.scores import Score, geometric_mean, score_of
from undertow.studies.arena.tasks import TASKS, VERSION
from undertow.studies.arena.vehicles import VEHICLES
from undertow.studies.campaign.run_campaign import STORE
from undertow.studies.comparison.sentences import digits
from undertow.studies.comparison.step_time import StepTime
from undertow.studies.comparison.tables import TextTable

STEP = "step_time.json"  # in the folder of a law
BASELINE = "robust"  # ratios are to its errors


class Standing(NamedTuple):
    """A law on the board.

    Attributes:
        entry: what is kept of it.
        score: its score.
        robustness: its errors over every parameter; empty where they were not computed.
        step: computing time of a control step; None where it was not measured.
    """

    entry: Entry
    score: Score
    robustness: dict[str, RobustnessCurve]
    step: StepTime | None


class Board(NamedTuple):
    """All laws, best first, and the tasks and vehicles that all of them ran."""

    standings: tuple[Standing, ...]
    cells: tuple[Cell, ...]

    @property
    def tasks(self) -> tuple[str, ...]:
        """Names of the tasks."""
        in_cells = {task for task, _ in self.cells}
        return tuple(task for task in TASKS if task in in_cells)

    @property
    def vehicles(self) -> tuple[str, ...]:
        """Names of the vehicles."""
        in_cells = {vehicle for _, vehicle in self.cells}
        return tuple(vehicle for vehicle in VEHICLES if vehicle in in_cells)

    def of_task(self, task: str) -> list[Cell]:
        """A task on all of its vehicles."""
        return [cell for cell in self.cells if cell[0] == task]

    def of_vehicle(self, vehicle: str) -> list[Cell]:
        """All tasks of a vehicle."""
        return [cell for cell in self.cells if cell[1] == vehicle]

    def data(self) -> dict[str, Any]:
        """The board as numbers, words and lists."""
        return {"version": VERSION, "laws": [_data(standing) for standing in self.standings]}


def board_of(out: Path) -> Board:
    """The board of the results in a folder.

    Raises:
        BadInput: results that are damaged, or of laws that ran other tasks.
        OSError: results that cannot be read.
    """
    folders = sorted(path for path in (out / LAWS).iterdir() if path.is_dir() and (path / ENTRY).exists())
    standings = []
    for folder in folders:
        entry = read_entry(folder)
        robustness = curves(folder / FOLDER) if (folder / FOLDER / STORE).exists() else {}
        standings.append(Standing(entry, score_of(entry, folder), robustness, _step(folder)))
    cells = standings[0].entry.cells
    for standing in standings:
        if standing.entry.cells != cells:
            hint = "Choose another folder for other tasks or vehicles"
            got = f"others for {standing.entry.name} than for {standings[0].entry.name}"
            raise BadInput("--out", "have the same tasks and vehicles for all laws", got, hint=hint)
    return Board(tuple(ranked(standings)), cells)


def ranked(standings: Sequence[Standing]) -> list[Standing]:
    """Those that lose fewest vehicles first, and among those the one with the least error."""
    return sorted(standings, key=lambda standing: (standing.score.lost, standing.score.error))


_HEAD = ("law", "error / tolerance", "within tolerance", "lost", "against robust", "input variation (%/s)", "step (us)")


def leader_rows(board: Board) -> TextTable:
    """The board, a row for each law."""
    baseline = next((standing.score for standing in board.standings if standing.entry.name == BASELINE), None)
    rows = []
    for standing in board.standings:
        score = standing.score
        against = "-" if baseline is None else digits(score.error / baseline.error)
        step = "-" if standing.step is None else f"{digits(1e6 * standing.step.median)}{_compiler(standing.step)}"
        error = f"{digits(score.error)} [{digits(score.low)}, {digits(score.high)}]"
        shares = (f"{100 * score.within:.1f} %", f"{100 * score.lost:.1f} %")
        rows.append((standing.entry.name, error, *shares, against, digits(100 * score.activity), step))
    return TextTable(_HEAD, rows)


def task_rows(board: Board) -> TextTable:
    """Error of every law in every task, in tolerances: the geometric mean over the vehicles."""
    rows = [
        (standing.entry.name, *(digits(standing.score.mean(board.of_task(task))) for task in board.tasks))
        for standing in board.standings
    ]
    return TextTable(("law", *(task.replace("_", " ") for task in board.tasks)), rows)


def vehicle_rows(board: Board) -> TextTable:
    """Error of every law on every vehicle, in tolerances: the geometric mean over the tasks."""
    rows = [
        (standing.entry.name, *(digits(standing.score.mean(board.of_vehicle(vehicle))) for vehicle in board.vehicles))
        for standing in board.standings
    ]
    return TextTable(("law", *board.vehicles), rows)


def ratio_rows(board: Board) -> TextTable:
    """Error of every law in every task / that of the baseline, as means over the vehicles; no rows without it."""
    scores = {standing.entry.name: standing.score for standing in board.standings}
    head = ("law", *(task.replace("_", " ") for task in board.tasks), "largest on one vehicle")
    if BASELINE not in scores:
        return TextTable(head, [])
    rows = []
    for name, score in scores.items():
        ratios = {cell: score.cells[cell].error / scores[BASELINE].cells[cell].error for cell in board.cells}
        means = (geometric_mean([ratios[cell] for cell in board.of_task(task)]) for task in board.tasks)
        rows.append((name, *map(digits, means), digits(max(ratios.values()))))
    return TextTable(head, rows)


def margin_rows(board: Board) -> TextTable:
    """The hardest level of every parameter up to which a law is within its tolerances."""
    rows = [
        (standing.entry.name, *(_level(standing.robustness[name]) for name in PARAMETERS))
        for standing in board.standings
        if standing.robustness
    ]
    return TextTable(("law", *(parameter.label for parameter in PARAMETERS.values())), rows)


def failures(board: Board) -> TextTable:
    """Every task and vehicle in which trials of a law failed or were refused."""
    rows = []
    for standing in board.standings:
        for cell, result in standing.score.cells.items():
            counts = [f"{word.replace('_', ' ')} {count}" for word, count in result.failed.items()]
            if counts:
                rows.append((standing.entry.name, *cell, ", ".join(counts)))
    return TextTable(("law", "task", "vehicle", "failed trials"), rows)


def as_csv(board: Board) -> str:
    """A line for every law, task and vehicle, in SI units."""
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    names = ("position_rms", "orientation_rms", "input_variation_share")
    writer.writerow(("law", "task", "vehicle", "error", *names, "failed", "trials"))
    for standing in board.standings:
        for cell, result in standing.score.cells.items():
            columns = (result.position, result.orientation, result.activity)
            medians = [_median(column) for column in columns]
            failed = sum(result.failed.values())
            writer.writerow((standing.entry.name, *cell, repr(result.error), *medians, failed, len(result.errors)))
    return text.getvalue()


def as_markdown(rows: TextTable) -> str:
    """A table in Markdown."""
    lines = [rows.head, ["---"] * len(rows.head), *rows.rows]
    return "".join(f"| {' | '.join(line)} |\n" for line in lines)


def _median(column: np.ndarray) -> str:
    """Median of the numbers of a column; empty where there are none."""
    return repr(float(np.nanmedian(column))) if np.isfinite(column).any() else ""


def _level(curve: RobustnessCurve) -> str:
    return "none" if curve.last != curve.last else f"{curve.last:g}{'+' * (curve.last == curve.levels[-1])}"


def _step(folder: Path) -> StepTime | None:
    """Computing time of a step; None where it was not measured, or the file is damaged."""
    try:
        data = json.loads((folder / STEP).read_text(encoding="utf-8"))
        return StepTime(float(data["median"]), str(data["backend"]))
    except (OSError, ValueError, KeyError, TypeError):
        return None


def _compiler(step: StepTime) -> str:
    return "" if step.backend == "simd" else " (XLA)"


def _data(standing: Standing) -> dict[str, Any]:
    score = standing.score
    return {
        "name": standing.entry.name,
        "controller": standing.entry.controller,
        "gains": standing.entry.gains,
        **{name: getattr(score, name) for name in ("error", "low", "high", "within", "lost", "activity")},
        "cells": [
            {
                "task": task,
                "vehicle": vehicle,
                "error": result.error,
                "errors": result.errors.tolist(),
                "failed": result.failed,
            }
            for (task, vehicle), result in score.cells.items()
        ],
        "robustness": {name: curve.data() for name, curve in standing.robustness.items()},
    }
