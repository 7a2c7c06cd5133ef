"""Samples: distributions by their quantiles, designs by what they are known for, seeds by being a matter of number."""

import numpy as np
import pytest
from scipy import stats

from undertow.core.errors import BadInput
from undertow.scenario.reading import from_data
from undertow.studies.campaign.campaign_schema import Distribution, validate
from undertow.studies.campaign.sampling import Samples, quantiles

TWO = {"loop.duration": {"uniform": [1, 2]}, "plant.limit": {"uniform": [0, 1]}}


def points(data, rows=None):
    """Of a campaign, one row each; all of them unless told which."""
    asked = validate(from_data(data))
    samples = Samples(asked)
    return samples.points(np.array(rows or range(asked.trials)))


@pytest.mark.parametrize(
    "given, law",
    [
        ({"uniform": [2.0, 5.0]}, stats.uniform(2, 3)),
        ({"log_uniform": [0.1, 10.0]}, stats.loguniform(0.1, 10)),
        ({"normal": [3.0, 0.5]}, stats.norm(3, 0.5)),
    ],
)
def test_values_are_quantiles(given, law):
    shares = np.array([0.0, 0.1, 0.5, 0.99])
    expected = law.ppf(np.maximum(shares, 2.0**-53))
    assert quantiles(Distribution.model_validate(given), shares) == pytest.approx(expected, rel=1e-9)


def test_choices_are_equally_likely():
    spread = Distribution.model_validate({"choice": ["a", "b", "c"]})
    found = quantiles(spread, np.arange(300) / 300)
    assert [found.count(one) for one in "abc"] == [100, 100, 100]


def test_latin_hypercubes_have_one_point_per_stratum(campaign):
    found = points(campaign(design="latin", trials=50, vary=TWO))
    for column in np.floor(50 * found).T:
        assert sorted(column) == list(range(50))


@pytest.mark.parametrize("trials, cells", [(64, 4), (8192, 64)])  # within a block, and of two
def test_sobol_points_are_a_net(campaign, trials, cells):
    """Every square of a chessboard has as many of them."""
    found = points(campaign(design="sobol", trials=trials, vary=TWO))
    _, counts = np.unique(np.floor(cells * found), axis=0, return_counts=True)
    assert counts.tolist() == [trials // cells**2] * cells**2


@pytest.mark.parametrize("design", ["random", "sobol"])
def test_draws_do_not_depend_on_how_many_there_are(campaign, design):
    """Nor on the order in which they are asked for; the last of very many is at hand without the others."""
    few, many = (campaign(design=design, trials=trials, vary=TWO) for trials in (5000, 50_000_000))
    rows = [4096, 3, 4999, 4095]
    np.testing.assert_array_equal(points(many, rows), points(few)[rows])
    assert len(np.unique(points(many, [0, 4096, 49_999_999]))) == 6


def test_random_points_fill_the_cube_evenly(campaign):
    """Both coordinates by Kolmogorov and Smirnov, over several blocks."""
    found = points(campaign(trials=20_000, vary=TWO))
    assert all(stats.kstest(column, "uniform").pvalue > 0.01 for column in found.T)
    assert abs(np.corrcoef(found.T)[0, 1]) < 0.02


def test_a_latin_hypercube_has_a_limit(campaign):
    with pytest.raises(BadInput, match="`trials` must be at most 10000000 with `design: latin`, but is 10000001"):
        points(campaign(design="latin", trials=10_000_001))


@pytest.mark.parametrize("design", ["random", "latin", "sobol"])
def test_draws_are_a_matter_of_the_seed(campaign, design):
    sample = lambda seed: points(campaign(design=design, seed=seed))
    np.testing.assert_array_equal(sample(1), sample(1))
    assert (sample(1) != sample(2)).all()


def test_no_two_trials_share_a_seed(campaign):
    samples = Samples(validate(from_data(campaign(trials=10_000))))
    assert len(np.unique(samples.seeds(np.arange(10_000)))) > 9990


@pytest.mark.parametrize(
    "spread, said",
    [
        ({"uniform": [2.0, 1.0]}, "have low below high"),
        ({"log_uniform": [0.0, 1.0]}, "have positive bounds"),
        ({"normal": [0.0, -1.0]}, "have a standard deviation that is not negative"),
        ({}, "have one of uniform, log_uniform, normal, choice"),
        ({"uniform": [0.0, 1.0], "normal": [0.0, 1.0]}, "have one of uniform"),
        ({"uniform": [1.0]}, "at least 2 entries"),
        ({"unifrom": [0.0, 1.0]}, "be a key of the campaign"),
    ],
)
def test_a_wrong_spread_is_told(campaign, spread, said):
    with pytest.raises(BadInput, match=said):
        validate(from_data(campaign(vary={"loop.duration": spread})))
