"""What the ablations put into the loop: laws and sensors with one thing changed."""

from functools import partial

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest

from undertow.controllers.presets.paper import paper
from undertow.core.contracts import Measurement
from undertow.disturbances import random_suite
from undertow.loop import sampled
from undertow.reproduction.ablations import gains, on_axes, study
from undertow.reproduction.ablations.command_fed import CommandFed
from undertow.reproduction.ablations.forgetting import Forgetting
from undertow.reproduction.ablations.incremental import Incremental
from undertow.reproduction.ablations.linear_observer import LinearObserver
from undertow.reproduction.ablations.rough_sensor import RoughSensor
from undertow.reproduction.ablations.thruster_loss import ThrusterLoss

LOAD = random_suite(0.5, step=0.3)


def samples(law, **options):
    run = sampled.simulate(on_axes.loop(law, LOAD, **options), duration=0.4, record_every=10)
    assert int(run.status) == 0
    return run.signals


def update_from_report(sensor, steps=12):
    """What a sensor makes of velocity 0.1, 0.2, ... and position 1, 2, ... on two axes."""
    path, told, measure = sensor.realize(jax.random.PRNGKey(3)), [], eqx.filter_jit(sensor.measure)
    truth = lambda k: Measurement(jnp.full(2, 1.0 + k), jnp.full(2, 0.1 * (1 + k)))
    state = sensor.init(path, truth(0))
    for k in range(steps):
        y, state = measure(path, state, 0.0, truth(k))
        told.append((float(y.position[0]), float(y.velocity[0])))
    return np.array(told)


def test_a_sensor_with_nothing_wrong_tells_the_truth():
    np.testing.assert_allclose(heard(RoughSensor(axes=2))[:, 1], 0.1 * np.arange(1, 13))


def test_a_late_sensor_tells_what_was():
    told = heard(RoughSensor(axes=2, delay=3.0))
    np.testing.assert_array_equal(told[:, 0], [1, 1, 1, 1, 2, 3, 4, 5, 6, 7, 8, 9])


def test_a_slow_sensor_repeats_itself():
    np.testing.assert_array_equal(heard(RoughSensor(axes=2, every=5.0))[:, 0], [1] * 5 + [6] * 5 + [11] * 2)


def test_resolution_and_bias():
    told = heard(RoughSensor(axes=2, resolution=0.25))[:, 1]
    np.testing.assert_allclose(told / 0.25, np.round(0.1 * np.arange(1, 13) / 0.25))
    np.testing.assert_allclose(heard(RoughSensor(axes=2, bias=0.5))[:, 1], 0.5 + 0.1 * np.arange(1, 13))


def test_noise_has_its_size():
    told = heard(RoughSensor(axes=2, noise=0.01), steps=400)
    assert np.std(told[:, 1] - 0.1 * np.arange(1, 401)) == pytest.approx(0.01, rel=0.1)


def test_observer_and_incremental_inversion_are_one_law():
    """d_hat = H (x_ddot - F - G u) either way; the two programs differ in the last digits only."""
    same = {"pole": gains.POLE, "stiffness": gains.STIFFNESS, "feedback": gains.FEEDBACK}
    observer, inversion = (samples(lambda model, law=law: law(model, **same)) for law in (LinearObserver, Incremental))
    np.testing.assert_allclose(inversion.error, observer.error, atol=1e-12)
    np.testing.assert_allclose(inversion.estimate, observer.estimate, atol=1e-9)
    table_1 = samples(paper).error  # in small signal the same again, but for the share of s in the adaptation
    assert float(jnp.abs(observer.error - table_1).max()) < 0.03 * float(jnp.abs(table_1).max())


def test_a_law_that_is_not_told_of_limits_is_the_same_without_them():
    plain, deaf = samples(paper), samples(lambda model: CommandFed(paper(model)))
    np.testing.assert_array_equal(deaf.error, plain.error)
    limited = partial(samples, goal=2.0, limit=1.0)
    own, wound_up = limited(paper), limited(lambda model: CommandFed(paper(model)))
    assert float(wound_up.weights_peak.max()) > 10 * float(own.weights_peak.max())


def test_forgetting_nothing_is_the_law_itself():
    np.testing.assert_array_equal(samples(lambda m: Forgetting(paper(m))).weights, samples(paper).weights)


def test_leakage_and_dead_zone():
    kept = samples(paper).weights[-1]
    assert float(jnp.abs(samples(lambda m: Forgetting(paper(m), leakage=1.0)).weights[-1]).sum()) < 0.7 * float(
        jnp.abs(kept).sum()
    )
    assert not samples(lambda m: Forgetting(paper(m), zone=1e3)).weights.any()


@pytest.mark.parametrize("number", [0, 1, 3])
def test_as_many_thrusters_fail_as_are_asked_for(number):
    left = np.asarray(ThrusterLoss(0.25, float(number)).realize(jax.random.PRNGKey(5)))
    assert sorted(left) == [0.25] * number + [1.0] * (8 - number)


def test_every_ablation_asks_predicts_and_names_its_variants():
    found = study.modules()
    assert [study.identity(module) for module in found] == [f"A{k}" for k in range(1, 22)]
    for module in found:
        assert module.QUESTION.endswith("?") and module.PREDICTION.endswith(".") and module.METRICS
    some = [module for module in found if study.identity(module) in ("A1", "A7")]
    for module in some:
        names = [variant.name for variant in module.variants(True)]
        assert len(set(names)) == len(names) > 1
