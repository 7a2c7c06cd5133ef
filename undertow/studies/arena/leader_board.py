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
        return tuple(task for task in TASKS if any(one == task for one, _ in self.cells))

    @property
    def vehicles(self) -> tuple[str, ...]:
        """Names of the vehicles."""
        return tuple(vehicle for vehicle in VEHICLES if any(one == vehicle for _, one in self.cells))

    def of_task(self, task: str) -> list[Cell]:
        """A task on all of its vehicles."""
        return [cell for cell in self.cells if cell[0] == task]

    def of_vehicle(self, vehicle: str) -> list[Cell]:
        """All tasks of a vehicle."""
        return [cell for cell in self.cells if cell[1] == vehicle]

    def data(self) -> dict[str, Any]:
        """The board as numbers, words and lists."""
        return {"version": VERSION, "laws": [_data(one) for one in self.standings]}


def board_of(out: Path) -> Board:
    """The board of the results in a folder.

    Raises:
        BadInput: results that are damaged, or of laws that ran other tasks.
        OSError: results that cannot be read.
    """
    folders = sorted(path for path in (out / LAWS).iterdir() if path.is_dir() and (path / ENTRY).exists())
    found = []
    for folder in folders:
        entry = read_entry(folder)
        robustness = curves(folder / FOLDER) if (folder / FOLDER / STORE).exists() else {}
        found.append(Standing(entry, score_of(entry, folder), robustness, _step(folder)))
    cells = found[0].entry.cells
    for one in found:
        if one.entry.cells != cells:
            hint = "Choose another folder for other tasks or vehicles"
            got = f"others for {one.entry.name} than for {found[0].entry.name}"
            raise BadInput("--out", "have the same tasks and vehicles for all laws", got, hint=hint)
    return Board(tuple(ranked(found)), cells)


def ranked(standings: Sequence[Standing]) -> list[Standing]:
    """Those that lose fewest vehicles first, and among those the one with the least error."""
    return sorted(standings, key=lambda one: (one.score.lost, one.score.error))


_HEAD = ("law", "error / tolerance", "within tolerance", "lost", "against robust", "input variation (%/s)", "step (us)")


def leader_rows(board: Board) -> TextTable:
    """The board, a row for each law."""
    baseline = next((one.score for one in board.standings if one.entry.name == BASELINE), None)
    rows = []
    for one in board.standings:
        score = one.score
        against = "-" if baseline is None else digits(score.error / baseline.error)
        step = "-" if one.step is None else f"{digits(1e6 * one.step.median)}{_compiler(one.step)}"
        error = f"{digits(score.error)} [{digits(score.low)}, {digits(score.high)}]"
        shares = (f"{100 * score.within:.1f} %", f"{100 * score.lost:.1f} %")
        rows.append((one.entry.name, error, *shares, against, digits(100 * score.activity), step))
    return TextTable(_HEAD, rows)


def task_rows(board: Board) -> TextTable:
    """Error of every law in every task, in tolerances: the geometric mean over the vehicles."""
    rows = [
        (one.entry.name, *(digits(one.score.mean(board.of_task(task))) for task in board.tasks))
        for one in board.standings
    ]
    return TextTable(("law", *(task.replace("_", " ") for task in board.tasks)), rows)


def vehicle_rows(board: Board) -> TextTable:
    """Error of every law on every vehicle, in tolerances: the geometric mean over the tasks."""
    rows = [
        (one.entry.name, *(digits(one.score.mean(board.of_vehicle(vehicle))) for vehicle in board.vehicles))
        for one in board.standings
    ]
    return TextTable(("law", *board.vehicles), rows)


def ratio_rows(board: Board) -> TextTable:
    """Error of every law in every task / that of the baseline, as means over the vehicles; no rows without it."""
    scores = {one.entry.name: one.score for one in board.standings}
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
    shown = [one for one in board.standings if one.robustness]
    rows = [(one.entry.name, *(_level(one.robustness[name]) for name in PARAMETERS)) for one in shown]
    return TextTable(("law", *(one.label for one in PARAMETERS.values())), rows)


def failures(board: Board) -> TextTable:
    """Every task and vehicle in which trials of a law failed or were refused."""
    rows = [
        (one.entry.name, *cell, ", ".join(f"{word.replace('_', ' ')} {count}" for word, count in result.failed.items()))
        for one in board.standings
        for cell, result in one.score.cells.items()
        if result.failed
    ]
    return TextTable(("law", "task", "vehicle", "failed trials"), rows)


def as_csv(board: Board) -> str:
    """A line for every law, task and vehicle, in SI units."""
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    names = ("position_rms", "orientation_rms", "input_variation_share")
    writer.writerow(("law", "task", "vehicle", "error", *names, "failed", "trials"))
    for one in board.standings:
        for cell, result in one.score.cells.items():
            columns = (result.position, result.orientation, result.activity)
            medians = [_median(column) for column in columns]
            failed = sum(result.failed.values())
            writer.writerow((one.entry.name, *cell, repr(result.error), *medians, failed, len(result.errors)))
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
        found = json.loads((folder / STEP).read_text(encoding="utf-8"))
        return StepTime(float(found["median"]), str(found["backend"]))
    except (OSError, ValueError, KeyError, TypeError):
        return None


def _compiler(step: StepTime) -> str:
    return "" if step.backend == "simd" else " (XLA)"


def _data(one: Standing) -> dict[str, Any]:
    score = one.score
    return {
        "name": one.entry.name,
        "controller": one.entry.controller,
        "gains": one.entry.gains,
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
        "robustness": {name: curve.data() for name, curve in one.robustness.items()},
    }
