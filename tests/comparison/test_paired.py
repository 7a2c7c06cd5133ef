"""Paired statistics against closed forms and numbers worked out by hand."""

import math

import numpy as np
import pytest

from undertow.studies.comparison.paired import completions, differences, holm, median_interval, rank_test

NAN = math.nan


def only(values):
    (found,) = differences(values)
    return found


def test_numbers_by_hand():
    """Differences -1, -2, -3, -4, -5, -6 of 10: a rank sum of zero, whose probability is 2 / 2^6 on both sides."""
    baseline = np.full(6, 10.0)
    found = only({"energy": {"old": baseline, "new": baseline - np.arange(1, 7)}})
    assert (found.candidate, found.baseline, found.pairs, found.left_out) == ("new", "old", 6, 0)
    assert (found.median, found.relative) == (-3.5, pytest.approx(-0.35))
    assert (found.smaller, found.larger) == (6, 0)
    assert found.p == found.p_holm == 2 / 2**6
    assert found.established


def test_wilcoxon_published_example():
    """Differences of Darwin's maize (Fisher 1935), in eighths of an inch: exact two-sided p of the rank test 0.0413."""
    apart = np.array([49, -67, 8, 16, 6, 23, 28, 41, 14, 29, 56, 24, 75, 60, -48.0])
    assert rank_test(apart) == pytest.approx(0.0413, abs=5e-5)


def test_only_trials_that_both_completed_count():
    first = np.array([1.0, NAN, 3, 4, 5, 6, 7, 8])
    second = np.array([2.0, 3, NAN, 6, math.inf, 8, 9, 10])
    found = only({"settling_time": {"a": first, "b": second}})
    assert (found.pairs, found.left_out) == (5, 3)
    assert (found.median, found.smaller, found.larger) == (2.0, 0, 5)
    assert math.isnan(found.p) and math.isnan(found.low) and not found.established  # fewer than six pairs


def test_a_candidate_beside_itself_differs_in_nothing():
    values = np.arange(1.0, 21.0)
    found = only({"energy": {"a": values, "b": values.copy()}})
    assert (found.median, found.low, found.high, found.relative) == (0, 0, 0, 0)
    assert (found.smaller, found.larger) == (0, 0)
    assert math.isnan(found.p) and not found.established


def test_relative_differences_need_positive_values():
    values = np.arange(-1.0, 7.0)
    assert math.isnan(only({"energy": {"a": values, "b": values + 1}}).relative)


def test_interval_of_seven_values_is_their_second_and_sixth():
    """A resample has its median at the least value with probability P(B(7, 1/7) >= 4) = 1.07 %, below 2.5 %, and at
    most at the second with P(B(7, 2/7) >= 4) = 12.4 %, above it.
    """
    values = np.array([1.0, 2, 4, 8, 16, 32, 64])
    assert median_interval(values[[3, 0, 6, 2, 5, 1, 4]]) == (2.0, 32.0)
    assert all(map(math.isnan, median_interval(values[:5])))


def test_holm_by_hand():
    assert holm([0.01, 0.04, 0.03]) == pytest.approx([0.03, 0.06, 0.06])
    assert holm([0.01, 0.04, 0.03, 0.005]) == pytest.approx([0.03, 0.06, 0.06, 0.02])
    assert holm([0.6, 0.7]) == [1.0, 1.0]
    corrected = holm([0.02, NAN, 0.02])
    assert corrected[::2] == pytest.approx([0.04, 0.04]) and math.isnan(corrected[1])
    assert holm([]) == []


def test_correction_is_for_all_tests_of_a_comparison():
    baseline = np.full(8, 10.0)
    each = {"a": baseline, "b": baseline - np.arange(1, 9), "c": baseline}
    found = differences({"energy": each, "input_rms": each})
    assert [(one.candidate, one.baseline) for one in found[::2]] == [("b", "a"), ("c", "a"), ("c", "b")]
    assert [one.p for one in found] == pytest.approx([2 / 2**8] * 2 + [NAN] * 2 + [2 / 2**8] * 2, nan_ok=True)
    assert found[0].p_holm == pytest.approx(4 * 2 / 2**8)  # four tests were made


def test_completed_trials_by_hand():
    """Ten trials that one of them alone completed: probability 2 / 2^10 where both are as likely."""
    first = np.array([True] * 12)
    found = completions({"a": first, "b": first & (np.arange(12) >= 10), "c": first})
    assert [(one.only_candidate, one.only_baseline) for one in found] == [(0, 10), (0, 0), (10, 0)]
    assert found[0].p == 2 / 2**10 and math.isnan(found[1].p)
    assert found[0].p_holm == 2 * found[0].p
