"""Scores of the laws: the error of every trial relative to the tolerance of its task, and what it cost.

The error of a trial is the root of the mean square of position and orientation error, each divided by its tolerance.
What is below a hundredth of the tolerance is of no use, and what is above ten times is lost: the vehicle hits or
leaves something. So an error counts from 0.01 to 10, and a run that failed as 10.
"""

from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np

from undertow.core.errors import BadInput
from undertow.core.status import Status
from undertow.studies.arena.entry import Cell, Entry
from undertow.studies.arena.tasks import METRICS, scenarios, tolerances
from undertow.studies.arena.vehicles import VEHICLES
from undertow.studies.campaign.store_results import Results, load

FINEST, LOST = 0.01, 10.0
_RESAMPLES, _SHARES = 1000, (2.5, 97.5)  # of the interval of a score


class CellResult(NamedTuple):
    """Trials of a law in one task on one vehicle.

    Attributes:
        errors: of each trial, in tolerances, from 0.01 to 10.
        position: rms per axis of the position error of each trial, m; NaN for a failed one.
        orientation: rms angle of each trial, rad.
        activity: variation of the inputs per second as a share of their limit, 1/s.
        failed: how the failed trials ended -> how many.
    """

    errors: np.ndarray
    position: np.ndarray
    orientation: np.ndarray
    activity: np.ndarray
    failed: dict[str, int]

    @property
    def error(self) -> float:
        """Median error, in tolerances."""
        return float(np.median(self.errors))


class Score(NamedTuple):
    """Score of a law.

    Attributes:
        name: of the law.
        error: geometric mean, over tasks and vehicles, of the median error in tolerances: what the rank is by where
            as few are lost.
        low, high: 95 % interval, from resampling the trials of every cell.
        within: share of the trials with position and orientation within their tolerances; every cell counts the same.
        lost: share of the trials that failed or had ten times the tolerance, likewise.
        activity: geometric mean of the median variation of the inputs, as a share of their limit per second.
        cells: task and vehicle -> its trials.
    """

    name: str
    error: float
    low: float
    high: float
    within: float
    lost: float
    activity: float
    cells: dict[Cell, CellResult]

    def mean(self, cells: Sequence[Cell]) -> float:
        """Geometric mean of the median errors of some cells; NaN where the law has none of them."""
        return geometric_mean([self.cells[cell].error for cell in cells if cell in self.cells])


def geometric_mean(numbers: Sequence[float]) -> float:
    """Geometric mean of positive numbers; NaN of none."""
    return float(np.exp(np.mean(np.log(numbers)))) if len(numbers) else float("nan")


def trial_errors(position: np.ndarray, orientation: np.ndarray, tolerances: Sequence[float]) -> np.ndarray:
    """Errors of trials, in tolerances, from 0.01 to 10; NaN counts as lost.

    Args:
        position: rms per axis, m.
        orientation: rms angle, rad.
        tolerances: of both.
    """
    in_tolerances = np.stack([position / tolerances[0], orientation / tolerances[1]])
    errors = np.sqrt(np.mean(in_tolerances**2, axis=0))
    return np.where(np.isfinite(errors), np.clip(errors, FINEST, LOST), LOST)


def score_of(entry: Entry, folder: Path) -> Score:
    """Score of a law from the folder with its results.

    Raises:
        BadInput: the results are damaged, or not complete.
    """
    try:
        results = load(folder)
    except OSError as error:
        hint = f"Run the arena again for {entry.name} with --overwrite"
        raise BadInput("--out", "have results that can be read", str(error).partition(";")[0], hint=hint) from None
    trials = results.campaign.trials
    results_of_cell = {cell: _refused(trials * len(scenarios(*cell))) for cell in entry.refused}
    results_of_cell |= _cells(entry.name, results, [cell for cell in entry.cells if cell not in entry.refused])
    return scored(entry.name, {cell: results_of_cell[cell] for cell in entry.cells})


def scored(name: str, cells: dict[Cell, CellResult]) -> Score:
    """Score of a law from its trials."""
    random = np.random.default_rng(0)
    medians = [np.median(_resampled(random, cell.errors), axis=1) for cell in cells.values()]
    low, high = np.percentile(np.exp(np.mean(np.log(medians), axis=0)), _SHARES)
    within = [np.mean(_within(result, cell)) for cell, result in cells.items()]
    lost = [np.mean(result.errors >= LOST) for result in cells.values()]
    active = [float(np.nanmedian(cell.activity)) for cell in cells.values() if np.isfinite(cell.activity).any()]
    return Score(
        name,
        geometric_mean([cell.error for cell in cells.values()]),
        float(low),
        float(high),
        float(np.mean(within)),
        float(np.mean(lost)),
        geometric_mean([max(activity, 1e-9) for activity in active]),
        cells,
    )


def _resampled(random: np.random.Generator, errors: np.ndarray) -> np.ndarray:
    return errors[random.integers(0, len(errors), (_RESAMPLES, len(errors)))]


def _within(result: CellResult, cell: Cell) -> np.ndarray:
    position, orientation = tolerances(*cell)
    return (result.position <= position) & (result.orientation <= orientation)  # NaN is not


def _refused(trials: int) -> CellResult:
    nothing = np.full(trials, np.nan)
    return CellResult(np.full(trials, LOST), nothing, nothing, nothing, {"refused": trials})


def _cells(law: str, results: Results, cells: Sequence[Cell]) -> dict[Cell, CellResult]:
    """The trials of a campaign by task and vehicle."""
    combinations, rows = results.combinations, results.rows
    names = {cell: tuple(scenarios(*cell)) for cell in cells}
    variants = range(sum(map(len, names.values())))
    number = {name: index for index, (name,) in enumerate(map(results.named, variants))}
    by_cell = {}
    for cell in cells:
        in_cell = np.isin(combinations, [number[name] for name in names[cell]])
        if not in_cell.any():
            hint = "Run the arena again for this law, which continues"
            raise BadInput("--out", "have trials of every task", f"none of {' on '.join(cell)} for {law}", hint=hint)
        column = lambda name, in_cell=in_cell: rows[name].values[in_cell].astype(float)
        status = rows["status"].values[in_cell]
        position, orientation = map(column, METRICS)
        words = [_word(code) for code in status[status != int(Status.OK)].tolist()]
        by_cell[cell] = CellResult(
            trial_errors(position, orientation, tolerances(*cell)),
            position,
            orientation,
            column("input_variation") / VEHICLES[cell[1]].limit,
            {word: words.count(word) for word in dict.fromkeys(words)},
        )
    return by_cell


def _word(code: int) -> str:
    return Status(code).word if code >= 0 else "invalid"
