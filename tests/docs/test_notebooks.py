"""The notebooks run, their exercises can be solved, and their checks find a missing and a wrong answer.

The cell of an exercise has a solution and a wrong answer in its metadata, key `exercise`; the next cell is its check. The
notebooks are executed once, with the solutions; after each check, the exercise runs again with a wrong answer and as the reader
finds it, and then with the solution, for the cells below.
"""

import re
from pathlib import Path

import nbformat
import pytest
from nbclient import NotebookClient
from nbformat import NotebookNode
from nbformat.v4 import new_code_cell

pytestmark = pytest.mark.docs

ROOT = Path(__file__).parents[2]
NOTEBOOKS = sorted((ROOT / "docs" / "notebooks").glob("*.ipynb"))
MOST_CELLS = 25
NUMBER = r"([-+]?[\d.]+(?:e[-+]?\d+)?)"

# Notebook -> what it prints, with the limits between which the number must lie: those of what its text says.
PRINTED = {
    "01_vehicle_at_sea": [
        (rf"^0\.25 m: +{NUMBER} cm, within: True", 1, 2),  # something else limits it in small waves
        (rf"^ 3\.5 m: +{NUMBER} cm, within: False", 5, 20),
        (rf"0\.8 m/s: {NUMBER} m, within: True", 0, 0.05),  # the limit is sudden
        (rf"1\.0 m/s: {NUMBER} m, within: False", 1, 10),
        (rf"own sensors: {NUMBER} mm", 10, 25),
        (rf"perfect navigation: {NUMBER} mm", 0, 2),
        (rf"^0\.1 s: position {NUMBER} mm", 5, 50),
    ],
    "02_your_own_law": [
        (rf"mean error {NUMBER} m", -0.55, -0.4),
        (rf"predicted {NUMBER} m", -0.55, -0.4),
        (rf"pid smaller in {NUMBER} of 10  established", 10, 10),
        (rf"pid smaller in {NUMBER} of 5  not established", 5, 5),
        (rf"At  1 V: +{NUMBER} N", 0, 0),
    ],
    "03_the_paper": [
        (rf"Rank {NUMBER}:", 6, 6),
        (rf"RAFC / RCAFC: {NUMBER}", 20, 100),
        (rf"{NUMBER} % of the time: d is constant", 0, 0),
        (rf"{NUMBER} % of the time: omega_bar", 0, 0),
        (rf"RCAFC on electromechanical: diverged, {NUMBER} s", 0.5, 2),
        (rf"^RAFC on electromechanical: completed, tracking error {NUMBER}", 0, 0.02),
        (rf"^RAFC: diverged at {NUMBER} s", 100, 2000),
        (rf"bounded by 20: completed at {NUMBER} s", 2000, 2000),
        (rf"robust variant: completed at {NUMBER} s", 2000, 2000),
    ],
}


def read(path: Path) -> NotebookNode:
    return nbformat.read(path, as_version=4)


def exercises(notebook: NotebookNode) -> list[int]:
    """Places of the cells of exercises."""
    return [place for place, cell in enumerate(notebook.cells) if "exercise" in cell.metadata]


def with_answers(notebook: NotebookNode) -> NotebookNode:
    """The notebook with its solutions, and after each check the same check for other answers; tagged by what is answered."""
    cells = []
    for place, cell in enumerate(notebook.cells):
        if "exercise" in cell.metadata:
            continue
        if place - 1 not in exercises(notebook):
            cells.append(cell)
            continue
        exercise = notebook.cells[place - 1]
        solution, wrong = ("\n".join(exercise.metadata["exercise"][answer]) for answer in ("solution", "wrong"))
        for answer, source in (("wrong", wrong), ("missing", exercise.source), ("solution", solution)):
            cells.append(new_code_cell(source))
            cells.append(new_code_cell(cell.source, metadata={"tags": [answer]}))
    return NotebookNode({**notebook, "cells": cells})


def printed(cell: NotebookNode) -> str:
    return "".join(output.text for output in cell.get("outputs", ()) if output.output_type == "stream")


def test_every_notebook_is_executed():
    assert [path.stem for path in NOTEBOOKS] == list(PRINTED)


@pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda path: path.stem)
def test_form(path):
    """Short, without outputs, listed, with an exercise, and every exercise before its check."""
    notebook = read(path)
    nbformat.validate(notebook)
    assert len(notebook.cells) <= MOST_CELLS
    code = [cell for cell in notebook.cells if cell.cell_type == "code"]
    assert not any(cell.outputs or cell.execution_count for cell in code)
    assert exercises(notebook)
    for place in exercises(notebook):
        assert "..." in notebook.cells[place].source
        assert notebook.cells[place + 1].source.startswith("# Check of")
    assert f"({path.name})" in (path.parent / "index.md").read_text("utf-8")


@pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda path: path.stem)
def test_runs_and_its_checks_tell_right_from_wrong(path, tmp_path):
    executed = with_answers(read(path))
    NotebookClient(executed, timeout=900, resources={"metadata": {"path": str(tmp_path)}}).execute()
    checks = {"solution": "Solved", "wrong": "Not solved yet: ", "missing": "Not solved yet: "}
    for cell in executed.cells:
        for answer in set(cell.metadata.get("tags", ())) & set(checks):
            assert printed(cell).startswith(checks[answer]), (answer, printed(cell))
    assert not any(output.get("name") == "stderr" for cell in executed.cells for output in cell.get("outputs", ()))
    text = "\n".join(printed(cell) for cell in executed.cells if cell.cell_type == "code")
    for pattern, low, high in PRINTED[path.stem]:
        found = re.search(pattern, text, re.MULTILINE)
        assert found, (pattern, text)
        assert low <= float(found[1]) <= high, found[0]
