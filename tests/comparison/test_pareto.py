"""Pareto fronts of points worked out by hand."""

import math

import numpy as np
import pytest

from undertow.studies.comparison.pareto import fronts, on_front


def test_front_by_hand():
    """(1, 5), (2, 3) and (4, 1) are on the front; (3, 3) is as good as (2, 3) in one and worse in the other."""
    points = [(1.0, 5.0), (2.0, 3.0), (4.0, 1.0), (3.0, 3.0), (4.0, 4.0)]
    assert on_front(points) == [True, True, True, False, False]
    assert on_front([(1.0, 1.0), (1.0, 1.0)]) == [True, True]
    assert on_front([]) == []


def test_front_agrees_with_its_definition_point_by_point():
    points = [tuple(point) for point in np.random.default_rng(3).integers(0, 8, (60, 2)).astype(float).tolist()]
    dominated = [any(x <= a and y <= b and (x < a or y < b) for x, y in points if (x, y) != (a, b)) for a, b in points]
    assert on_front(points) == [not one for one in dominated]
    assert 1 < sum(on_front(points)) < 60


def test_failed_candidates_neither_win_nor_dominate():
    medians = {
        "position_rms": {"a": 2.0, "b": 1.0, "c": 0.1, "d": math.nan, "e": 3.0},
        "input_rms": {"a": 1.0, "b": 2.0, "c": 0.1, "d": 1.0, "e": 3.0},
    }
    (front,) = fronts(medians, {"a": True, "b": True, "c": False, "d": True, "e": True})
    assert front.front == ("b", "a") and front.incomplete == ("c",)
    assert set(front.points) == {"a", "b", "c", "e"}
    assert front.data()["points"]["a"] == [2.0, 1.0]


def test_what_is_drawn():
    """Position and attitude where both are known, the tracking error otherwise; none where all medians are equal."""
    same = {"a": 1.0, "b": 1.0}
    apart = {"a": 1.0, "b": 2.0}
    complete = {"a": True, "b": True}
    both = fronts({"tracking_rms": apart, "attitude_rms": apart, "input_rms": same, "input_variation": same}, complete)
    assert [(one.error, one.effort) for one in both] == [
        ("attitude_rms", "input_rms"),
        ("attitude_rms", "input_variation"),
    ]
    assert [one.error for one in fronts({"tracking_rms": apart, "input_rms": same}, complete)] == ["tracking_rms"]
    assert fronts({"position_rms": same, "input_rms": same}, complete) == ()


@pytest.mark.parametrize("effort", ["input_rms", "input_variation"])
def test_better_in_both_is_alone_on_the_front(effort):
    (front,) = fronts({"position_rms": {"a": 1.0, "b": 2.0}, effort: {"a": 3.0, "b": 4.0}}, {"a": True, "b": True})
    assert front.front == ("a",)
