"""Statistics of durations against NumPy's."""

import numpy as np
import pytest

from undertow.outside.realtime.loop_statistics import Durations


@pytest.mark.parametrize("spread", [0.0, 0.5, 2.0])
def test_quantiles_are_those_of_the_sorted_values_to_one_percent(spread):
    values = 1e-4 * np.exp(spread * np.random.default_rng(1).normal(size=20_000))
    found = Durations()
    for value in values:
        found.add(value)
    summary = found.summary()
    assert summary["number"] == 20_000 and summary["max"] == values.max()
    assert summary["mean"] == pytest.approx(values.mean()) and summary["rms"] == pytest.approx(
        (values**2).mean() ** 0.5
    )
    for name, rank in (("p50", 10_000), ("p99", 19_800), ("p99.9", 19_980)):
        assert summary[name] == pytest.approx(np.sort(values)[rank - 1], rel=0.01), name


def test_extremes_have_a_place():
    found = Durations()
    for value in (-1.0, 0.0, 1e-12, 1e9):
        found.add(value)
    assert found.quantile(0.5) == 0.0 and found.quantile(1.0) == 1e9 and found.summary()["max"] == 1e9
    assert Durations().summary() == {} and np.isnan(Durations().quantile(0.5))
