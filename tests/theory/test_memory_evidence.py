"""Whether a memory helps is seen in the observer's modelling error: what harms is not used, what changed is learnt anew."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from undertow.control.controllers import rcaf
from undertow.control.controllers.robust import evidence
from undertow.control.controllers.robust.estimator import Estimator
from undertow.control.controllers.robust.memory import TrainingSample, memory
from undertow.control.estimation.fuzzy_system import gaussian_sets
from undertow.control.navigation import perfect
from undertow.control.references import sine
from undertow.physics.disturbances import sinusoid
from undertow.physics.plants import double_integrator
from undertow.simulation.loop import simd_batch
from undertow.simulation.loop.closed_loop import ClosedLoop

pytestmark = pytest.mark.full

DT = 0.02
JUDGING = 30.0
OBSERVER = Estimator(gaussian_sets(1), bandwidth=8.0, leakage=0.0)


def collected(alone, explained):
    """Evidence of a sequence of modelling errors of one axis."""
    return _collected(jnp.stack([alone, explained], 1)[:, :, None])


@jax.jit
def _collected(series):
    step = lambda found, both: (evidence.gathered(found, both[0], both[1], DT, JUDGING), None)
    return jax.lax.scan(step, evidence.none(1), series)[0]


def motion(seconds):
    return jnp.sin(0.7 * DT * jnp.arange(int(seconds / DT), dtype=float))


@pytest.mark.parametrize("factor", [1.6, 1.0, 0.3, -1.0])
def test_the_best_share_is_that_of_least_squares(factor):
    """An uncertainty that is `factor` times what the memory holds, with what the memory knows nothing of."""
    explained, time = 1e-2 * motion(120.0), np.arange(6000) * DT
    other = 4e-3 * jnp.cos(0.7 * time)
    found = collected(factor * explained + other, explained)
    weight = (1 - DT / JUDGING) ** np.arange(5999, -1, -1)
    alone = np.asarray(factor * explained + other)
    least = (weight * alone * np.asarray(explained)).sum() / (weight * np.asarray(explained) ** 2).sum()
    np.testing.assert_allclose(evidence.best_share(found)[0][0], least, rtol=1e-9)
    np.testing.assert_allclose(evidence.trust(found)[0], np.clip(least + evidence.best_share(found)[1][0], 0, 1))


def test_a_memory_that_helps_is_used_in_full_in_waves_three_times_as_large():
    """Seas of 5 s period with random amplitudes and phases: not correlated with the reference."""
    explained, time = 1e-2 * motion(60.0), DT * np.arange(3000)
    random = np.random.default_rng(0)
    for _ in range(20):
        frequency, phase = random.uniform(0.9, 2.5, (8, 1)), random.uniform(0, 2 * np.pi, (8, 1))
        sea = 3e-2 / np.sqrt(8) * np.cos(frequency * time + phase).sum(0)
        found = collected(explained + jnp.asarray(sea), explained)
        assert evidence.trust(found)[0] == 1.0
        assert evidence.wrong(found) < 0.1


def test_nothing_is_judged_before_the_memory_explains_anything():
    found = collected(motion(20.0), 0 * motion(20.0))
    assert evidence.trust(found)[0] == 1.0
    assert evidence.wrong(found) == 0.0


def test_the_modelling_error_without_a_memory_is_known_without_a_second_observer():
    """eps + g W^T (modelling error of phi) equals that of an observer that has no memory, for constant W and g."""
    part = memory(2, regressor="linear")
    state, used = part.init(2, False), 0.6
    weights = jnp.asarray(np.random.default_rng(1).uniform(-1, 1, state.weights.shape))
    phis = jnp.asarray(np.random.default_rng(2).normal(size=(200, weights.shape[0])))
    load = jnp.asarray(np.random.default_rng(3).normal(size=(200, 2)))
    with_memory = without = OBSERVER.init(jnp.zeros(2))
    velocity, still, gains = jnp.zeros(2), jnp.zeros(2), OBSERVER.gains(jnp.asarray(DT))
    step = jax.jit(
        lambda state, phi: part.advance(state, phi, TrainingSample(*6 * [still]), gains, jnp.ones(()), DT)[0]
    )
    observed = jax.jit(lambda z, v, more: OBSERVER.advance(z, OBSERVER.estimate(z, v), more, jnp.zeros(2), DT))
    for phi, d in zip(phis, load, strict=True):
        with_memory = observed(with_memory, velocity, used * weights.T @ phi)
        without = observed(without, velocity, still)
        velocity = velocity + DT * d
        state = step(state, phi)
    one, other = (OBSERVER.estimate(z, velocity).error for z in (with_memory, without))
    assert np.abs(one - other).max() > 1e-2
    np.testing.assert_allclose(one + used * weights.T @ state.ahead, other, atol=1e-9)


def test_the_covariance_of_a_memory_that_is_wrong_returns_to_its_start_and_never_exceeds_it():
    part = memory(2, regressor="linear", horizon=50.0)
    start = part.init(2, False)
    start = start._replace(weights=start.weights + 0.5, covariance=1e-3 * start.covariance)
    gains, count = OBSERVER.gains(jnp.asarray(DT)), start.weights.shape[0]
    waves = jnp.sin(DT * jnp.arange(6000, dtype=float)[:, None] * jnp.linspace(0.3, 1.5, count)[None, :])

    def step(state, phi):
        nothing, error = jnp.zeros(2), -2 * state.weights.T @ state.ahead  # of a load that is minus what is remembered
        return part.advance(state, phi, TrainingSample(nothing, error, *4 * [nothing]), gains, jnp.ones(()), DT)[
            0
        ], None

    last = jax.jit(lambda state: jax.lax.scan(step, state, waves)[0])(start)
    assert np.linalg.eigvalsh(np.asarray(last.covariance)).min() > 0
    assert np.linalg.eigvalsh(part.learning_rate * np.eye(count) - np.asarray(last.covariance)).min() > -1e-9
    np.testing.assert_array_equal(evidence.trust(last.evidence), 0.0)
    assert np.trace(last.covariance) > 5 * np.trace(start.covariance)


def errors(law, plant):
    loop = ClosedLoop(plant, law, sine(0.5, 1.0), sinusoid(0.8, 1.0, phase=0.3), perfect())
    run = simd_batch.simulate(loop, duration=120.0, dt=DT, record_every=5)
    return np.asarray(run.signals["error"])[:, 0], run


def test_knowledge_with_the_wrong_sign_is_not_used_and_is_replaced(tmp_path):
    """Twice the error of no memory at first; the memory is dropped, learns and is used again."""
    plant = double_integrator(1)
    options = {"sampling_time": DT, "bandwidth": 4.0, "tracking": 2.0}
    plain, _ = errors(rcaf(plant.model(), preset="robust", **options), plant)
    learning = lambda **more: rcaf(plant.model(), preset="learning", regressor="linear", **options, **more)
    _, learnt = errors(learning(), plant)
    weights, variance = (np.asarray(learnt.signals[f"memory_{name}"])[-1] for name in ("weights", "variance"))
    np.savez(tmp_path / "turned.npz", weights=-weights, variance=variance)
    turned, run = errors(learning(knowledge=str(tmp_path / "turned.npz")), plant)
    blind, _ = errors(learning(knowledge=str(tmp_path / "turned.npz"), judging_time=1e6), plant)
    rms = lambda off, begin, end: np.sqrt((off[int(10 * begin) : int(10 * end)] ** 2).mean())
    trust = np.asarray(run.signals["memory_trust"])[:, 0]
    assert trust.min() < 0.05
    assert trust[-1] == 1.0
    assert rms(turned, 6, 120) < rms(plain, 6, 120)
    assert rms(turned, 60, 120) < 0.2 * rms(plain, 60, 120)
    assert rms(turned, 6, 40) < rms(blind, 6, 40)
