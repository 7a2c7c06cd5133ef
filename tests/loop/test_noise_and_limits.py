"""Noise is a function of key and number of the sample alone; limits are respected, and the law learns from what was applied."""

import functools

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from recorded import is_as_recorded

from undertow.control.controllers.rcaf import rcaf
from undertow.control.navigation.degraded import degraded
from undertow.control.navigation.perfect import perfect
from undertow.control.navigation.white_noise import white_noise
from undertow.control.references.setpoint import setpoint
from undertow.core.contracts import Measurement
from undertow.physics.disturbances.sinusoid import sinusoid
from undertow.physics.plants.double_integrator import double_integrator
from undertow.scenario.build import velocity_noise_of
from undertow.simulation.loop import sampled
from undertow.simulation.loop.closed_loop import ClosedLoop

LIMIT, DT = 3.0, 1e-3


def measured(key, samples, truth=0.0, dt=1e-3):
    """Measurements of a plant that stands still, one after the other."""
    return jax.tree.map(np.asarray, _measured(key, samples, truth, dt))


@functools.partial(jax.jit, static_argnames="samples")
def _measured(key, samples, truth, dt):
    sensor = white_noise(0.1, 0.2)
    path, still = sensor.realize(key), Measurement(jnp.full(3, truth), jnp.full(3, truth))

    def step(state, t):
        measured, state = sensor.measure(path, state, t, still)
        return state, measured

    return jax.lax.scan(step, sensor.init(path, still), dt * jnp.arange(samples, dtype=float))[1]


def test_noise_depends_on_key_and_sample_only(key):
    usual = measured(key, 50)
    np.testing.assert_array_equal(measured(key, 200).position[:50], usual.position, err_msg="however long")
    np.testing.assert_array_equal(measured(key, 50, dt=4e-3).velocity, usual.velocity, err_msg="however fast")
    np.testing.assert_allclose(measured(key, 50, truth=7.0).position - 7.0, usual.position, atol=1e-14)
    other = measured(jax.random.fold_in(key, 1), 50)
    assert (other.position != usual.position).all()


def test_noise_is_white_with_the_given_deviations(key):
    y = measured(key, 20_000)
    for series, deviation in ((y.position, 0.1), (y.velocity, 0.2)):
        assert series.std(0) == pytest.approx(deviation, rel=0.03)
        assert np.abs(series.mean(0)).max() < 5 * deviation / np.sqrt(20_000)
        neighbours = (series[1:] * series[:-1]).mean(0) / deviation**2
        assert np.abs(neighbours).max() < 5 / np.sqrt(20_000)


@pytest.mark.full
def test_two_laws_meet_the_same_noise(key):
    """From eps = x_hat_dot - (x_dot + noise), both runs give back the same noise at every step."""
    plant = double_integrator(2)

    def noise(**gains):
        law = rcaf(plant.model(), preset="paper", **gains)
        loop = ClosedLoop(plant, law, setpoint(np.ones(2)), sinusoid(), white_noise(0.0, 0.01))
        samples = sampled.simulate(loop, duration=0.2, dt=DT, record_every=1, key=key).signals
        return np.asarray(samples["predicted_velocity"] - samples["modelling_error"] - samples["velocity"])

    one, other = noise(), noise(composite=0.0, feedback=(4.0, 4.0))
    np.testing.assert_allclose(one, other, atol=1e-12)
    assert 0.005 < one.std() < 0.02


@pytest.fixture(scope="module")
def limited():
    plant = double_integrator(2, LIMIT)
    law = rcaf(plant.model(), preset="paper", sets=3)
    loop = ClosedLoop(plant, law, setpoint(np.array([2.0, -1.0])), sinusoid(1.0, 2.0), perfect())
    samples = jax.tree.map(np.asarray, sampled.simulate(loop, duration=2.0, dt=DT, record_every=1).signals)
    is_as_recorded("loop: two axes with limits", [samples[name][::50] for name in sorted(samples)])
    return law, samples


def test_limits_are_respected(limited):
    _, samples = limited
    assert np.abs(samples["commanded_input"]).max() > 3 * LIMIT, "the law does ask for more"
    np.testing.assert_array_equal(samples["input"], np.clip(samples["commanded_input"], -LIMIT, LIMIT))
    np.testing.assert_array_equal(samples["saturated"], (np.abs(samples["input"]) >= LIMIT).astype(float))
    assert 0 < samples["saturated"].mean() < 1


def test_law_is_advanced_with_what_was_applied(limited):
    """One Euler step of Eq. (32) from record to record: right with the applied input, wrong with the command."""
    law, samples = limited
    eps, now = samples["modelling_error"], samples["predicted_velocity"]
    own = -150.0 * eps + samples["estimate"] - 0.1 * np.tanh(eps / 0.5)
    expected = {name: now + DT * (own + samples[name]) for name in ("input", "commanded_input")}
    np.testing.assert_allclose(expected["input"][:-1], now[1:], atol=1e-12)
    assert np.abs(expected["commanded_input"][:-1] - now[1:]).max() > 1e-3
    xi_sum = samples["weights"].shape[-1]
    assert xi_sum == law.fuzzy.rules


def test_plant_moves_with_what_was_applied(limited):
    _, samples = limited
    acceleration = samples["input"] + np.sin(2.0 * DT * np.arange(len(samples["input"])))[:, None]
    np.testing.assert_allclose(np.diff(samples["velocity"], axis=0) / DT, acceleration[:-1], atol=2e-3)


def test_a_law_is_told_the_noise_of_the_velocities():
    """Of one step of the loop: readings that come five times as seldom are as good as white noise of sqrt(5) times."""
    axes = np.array([0.02, 0.03])
    np.testing.assert_allclose(velocity_noise_of(white_noise(0.1, axes), DT), axes)
    seldom = degraded(0.1, axes, period=5 * DT, sampling_time=DT)
    np.testing.assert_allclose(velocity_noise_of(seldom, DT), 5**0.5 * axes, rtol=1e-6)
    assert velocity_noise_of(perfect(), DT) == 0
