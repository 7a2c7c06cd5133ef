"""Medians, intervals and seeds of the ablations, against closed forms and single runs."""

import math

import jax
import numpy as np
import pytest
from scipy.stats import binom

from undertow.analysis.metrics import Metrics, results
from undertow.controllers.presets.paper import paper
from undertow.disturbances import random_suite
from undertow.loop import sampled
from undertow.reproduction.ablations import on_axes, runner
from undertow.reproduction.ablations.ablation import Schedule
from undertow.reproduction.ablations.rough_sensor import RoughSensor
from undertow.reproduction.ablations.summary import median_rank, spread, summary
from undertow.reproduction.ablations.tuning import ERROR, VARIATION, cost, tuned
from undertow.reproduction.all_outputs import with_all_outputs

SHORT = Schedule(duration=0.4)


def test_median_and_intervals_of_the_first_thirty_numbers():
    """The 95 % interval of the median of 30 is from the 10th to the 21st, with 95.7 %."""
    found = spread(np.random.default_rng(0).permutation(np.arange(1.0, 31.0)))
    assert found == (15.5, 2.0, 29.0, 10.0, 21.0)


@pytest.mark.parametrize("count", [6, 8, 30, 100, 1000])
def test_interval_of_the_median_covers_95_percent_and_hardly_more(count):
    rank = median_rank(count)
    covered = lambda r: 1 - 2 * binom.cdf(r - 1, count, 0.5)
    assert covered(rank) >= 0.95 > covered(rank + 1)


def test_interval_holds_the_median_as_often_as_it_says():
    draws = np.random.default_rng(1).exponential(size=(2000, 30))
    inside = [one.median_low <= math.log(2) <= one.median_high for one in map(spread, draws)]
    assert np.mean(inside) == pytest.approx(0.957, abs=0.015)


def test_runs_that_ended_early_are_infinitely_bad():
    assert spread([1.0, 2.0, np.inf]).median == 2.0
    assert spread([1.0, np.inf, np.inf]).median == np.inf
    found = summary({"status": np.array([0, 1, 0]), "tracking_rms": np.array([1.0, np.inf, 3.0])}, ("tracking_rms",))
    assert (found.seeds, found.failures, found["tracking_rms"]) == (3, 1, 3.0)


def test_seeds_together_are_the_runs_one_by_one():
    loop = on_axes.loop(paper, navigation=RoughSensor(noise=1e-3))
    together = runner.run(loop, SHORT, 3)
    keys = runner.keys(runner.HELD_OUT, 3)
    for key, error, miss in zip(keys, together["tracking_rms"], together["estimation_rms"], strict=True):
        alone = sampled.simulate(
            loop, duration=0.4, key=key, record_every=0, accumulators=(Metrics(0.2, np.nextafter(0.4, 0.0)),)
        )
        metrics = with_all_outputs(results((Metrics(),), alone.accumulated))
        np.testing.assert_allclose([error, miss], [metrics["tracking_rms"], metrics["estimation_rms"]], rtol=1e-12)
    assert len(set(together["tracking_rms"])) == 3


def test_training_seeds_are_not_reported():
    known = {tuple(np.asarray(key)) for key in runner.keys(runner.TRAINING, 100)}
    assert not known & {tuple(np.asarray(key)) for key in runner.keys(runner.HELD_OUT, 100)}


def test_an_ablation_with_a_known_answer():
    """One set or five, the same gamma |xi|^2: the same errors, as long as the modelling error is small (I18)."""
    load = random_suite(0.2, step=0.1)
    gamma = 100 * on_axes.basis_norm_squared() / on_axes.basis_norm_squared(sets=1)
    five = runner.run(on_axes.loop(paper, load), SHORT, 2)
    one = runner.run(on_axes.loop(lambda model: paper(model, sets=1, adaptation=gamma), load), SHORT, 2)
    for metric in ("tracking_rms", "estimation_rms"):
        np.testing.assert_allclose(one[metric], five[metric], rtol=5e-3)


def test_an_unstable_variant_is_counted_and_not_averaged():
    found = runner.run(on_axes.loop(lambda model: paper(model, adaptation=1e6), random_suite(0.2, step=0.1)), SHORT, 2)
    assert (found["status"] != 0).all()
    assert np.isinf(found["tracking_rms"]).all() and np.isinf(found["lost_axes"]).all()


def test_search_takes_the_cheapest_of_its_grid(monkeypatch):
    tried = []

    def pretend(loop, schedule, seeds, family):
        tried.append((loop, seeds, family))
        first, second = loop
        return {"tracking_rms": np.full(seeds, ERROR * (first - 3) ** 2), "input_variation": np.full(seeds, second)}

    monkeypatch.setattr("undertow.reproduction.ablations.tuning.run", pretend)
    best = tuned(lambda *point: point, ((1.0, 3.0, 9.0), (0.0, VARIATION)), SHORT, seeds=5)
    assert best == ((3.0, 0.0), (3.0, 0.0), 0.0, 6)
    assert {(seeds, family) for _, seeds, family in tried} == {(5, runner.TRAINING)}


def test_cost_is_a_median():
    outcomes = {"tracking_rms": ERROR * np.array([1.0, 2.0, np.inf]), "input_variation": VARIATION * np.ones(3)}
    assert cost(outcomes) == pytest.approx(3.0)


def test_loads_have_the_size_that_is_asked_for():
    load = random_suite(2.0, 1.0, 10.0, step=3.0, hold=0.5, span=200.0)
    times = np.arange(0.0, 200.0, 0.05)
    plant = on_axes.loop(paper).plant

    @jax.jit
    def signal(key):
        path = load.realize(key)
        return jax.vmap(lambda t: load.at(path, t, None, plant.no_load()).acceleration)(times)

    values = np.asarray([signal(key) for key in jax.random.split(jax.random.PRNGKey(0), 8)])
    assert np.sqrt((values**2).mean()) == pytest.approx(math.hypot(2.0, 3.0), rel=0.03)
    assert np.abs(values[0] - values[1]).max() > 1
    jumps = np.asarray(load.jumps(2.0))
    np.testing.assert_allclose(jumps, [0.5, 1.0, 1.5])
