"""Scores of the arena against numbers worked out by hand."""

import math

import numpy as np
import pytest

from undertow.studies.arena.leader_board import as_markdown
from undertow.studies.arena.robustness import RobustnessCurve
from undertow.studies.arena.scores import CellResult, geometric_mean, scored, trial_errors
from undertow.studies.comparison.tables import TextTable

STATION, MOTION = ("station_keeping", "odin"), ("delay", "odin")  # tolerances: 0.05 m, 5 degrees


def result(position, orientation=(0.0,)) -> CellResult:
    position, orientation = np.broadcast_arrays(np.array(position, float), np.array(orientation, float))
    errors = trial_errors(position, orientation, (0.05, math.radians(5)))
    return CellResult(errors, position, orientation, np.full(len(position), 0.2), {})


def test_error_of_a_trial():
    """3 and 4 tolerances are sqrt((9 + 16) / 2); nothing counts below 0.01 or above 10, and no number as 10."""
    found = trial_errors(np.array([3.0, 0.0, 1e9, np.nan]), np.array([4.0, 0.0, 0.0, 0.0]), (1.0, 1.0))
    np.testing.assert_allclose(found, [math.sqrt(12.5), 0.01, 10.0, 10.0], rtol=1e-15)


def test_score_is_the_geometric_mean_of_medians():
    one = result([0.05, 0.05, 5.0])  # median: one tolerance of position, none of orientation
    other = result([0.2, 0.2, 0.2])
    score = scored("law", {STATION: one, MOTION: other})
    each = np.array([1.0, 4.0]) / math.sqrt(2)
    assert score.error == pytest.approx(math.sqrt(each.prod()), rel=1e-12)
    assert score.mean([STATION]) == pytest.approx(each[0]) and math.isnan(score.mean([]))
    assert score.within == pytest.approx(2 / 6) and score.lost == pytest.approx(1 / 6)
    more = result([0.2] * 30)  # every task counts the same, whatever its trials
    assert scored("law", {STATION: one, MOTION: more}).lost == pytest.approx(1 / 6)
    assert score.low <= score.error <= score.high
    assert score.activity == pytest.approx(0.2)


def test_interval_of_equal_trials_is_a_point():
    score = scored("law", {STATION: result([0.1, 0.1, 0.1])})
    assert score.low == score.high == pytest.approx(score.error)


def test_geometric_mean():
    assert geometric_mean([1.0, 100.0]) == pytest.approx(10.0) and math.isnan(geometric_mean([]))


def test_last_level_within_the_tolerance():
    """The level before the first at which any trial is beyond; what comes after does not count."""
    of = lambda high: RobustnessCurve((1.0, 2.0, 3.0), np.array(high), np.array(high), np.array(high))
    assert of([0.5, 0.9, 0.9]).last == 3.0
    assert of([0.5, 1.1, 0.9]).last == 1.0
    assert math.isnan(of([1.1, 0.5, 0.5]).last)


def test_markdown_table():
    assert as_markdown(TextTable(("law", "error"), [("pid", "1")])) == "| law | error |\n| --- | --- |\n| pid | 1 |\n"
