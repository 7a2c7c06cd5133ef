"""A run without series, with accumulators, is the run with series: record_every = 0 loses nothing."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from undertow.control.controllers.rcaf import rcaf
from undertow.control.navigation.white_noise import white_noise
from undertow.control.references.setpoint import setpoint
from undertow.physics.disturbances.sinusoid import sinusoid
from undertow.physics.plants.double_integrator import double_integrator
from undertow.simulation.loop import sampled
from undertow.simulation.loop.closed_loop import ClosedLoop

pytestmark = pytest.mark.full

TICKS, DT = 600, 2e-3


class Gathered(sampled.AbstractAccumulator):
    """Number of samples, sum of times and of squared errors, largest |d_hat|, last input."""

    def init(self, sample):
        zero = jnp.zeros(())
        return zero, zero, jnp.zeros_like(sample["error"]), jnp.zeros_like(sample["estimate"]), sample["input"]

    def update(self, state, t, sample):
        count, times, squares, largest, _ = state
        largest = jnp.maximum(largest, jnp.abs(sample["estimate"]))
        return count + 1, times + t, squares + sample["error"] ** 2, largest, sample["input"]


@pytest.fixture(scope="module")
def runs():
    plant = double_integrator(2, 4.0)
    load = sinusoid(np.array([3.0, 1.0]), np.array([2.0, 9.0]))
    loop = ClosedLoop(plant, rcaf(plant.model(), preset="paper"), setpoint(np.array([1.0, -0.5])), load, white_noise())
    return {
        every: sampled.simulate(
            loop,
            duration=TICKS * DT,
            dt=DT,
            record_every=every,
            accumulators=(Gathered(),),
            key=jax.random.PRNGKey(5),
            method="euler",
        )
        for every in (0, 1, 10)
    }


def test_same_end_however_much_is_recorded(runs):
    for every in (1, 10):
        for one, other in zip(jax.tree.leaves(runs[0].final), jax.tree.leaves(runs[every].final), strict=True):
            np.testing.assert_allclose(np.asarray(one), np.asarray(other), rtol=1e-12, atol=1e-14)


def test_accumulated_is_the_sum_of_the_series(runs):
    series = jax.tree.map(lambda leaf: np.asarray(leaf)[:-1], runs[1].signals)  # the end is after the last step
    time = np.asarray(runs[1].time)[:-1]
    for run in runs.values():
        count, times, squares, largest, last = map(np.asarray, run.accumulated[0])
        assert count == TICKS
        np.testing.assert_allclose(times, time.sum(), rtol=1e-12)
        np.testing.assert_allclose(squares, (series["error"] ** 2).sum(0), rtol=1e-11)
        np.testing.assert_allclose(largest, np.abs(series["estimate"]).max(0), rtol=1e-11)
        np.testing.assert_allclose(last, series["input"][-1], rtol=1e-10, atol=1e-12)


def test_records_are_every_tenth_tick_and_the_end(runs):
    fine, coarse, none = runs[1], runs[10], runs[0]
    np.testing.assert_allclose(np.asarray(fine.time), DT * np.arange(TICKS + 1), rtol=1e-14)
    np.testing.assert_allclose(np.asarray(coarse.time), np.asarray(fine.time)[::10], rtol=1e-14)
    assert none.time.shape == (0,) and none.signals["error"].shape == (0, 2)
    for name in ("position", "estimate", "input"):
        pair = np.asarray(coarse.signals[name]), np.asarray(fine.signals[name])[::10]
        np.testing.assert_allclose(*pair, rtol=1e-10, atol=1e-12, err_msg=name)


def test_the_last_record_is_the_final_state(runs):
    x, z = runs[10].final
    np.testing.assert_array_equal(np.asarray(runs[10].signals["position"][-1]), np.asarray(x.position))
    np.testing.assert_array_equal(
        np.asarray(runs[10].signals["predicted_velocity"][-1]), np.asarray(z.predicted_velocity)
    )
