"""Memory of preset `learning`: least squares, what is not excited, the hand-over, and knowledge that is kept."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from undertow.control.controllers import rcaf
from undertow.control.controllers.robust.estimator import Estimator
from undertow.control.controllers.robust.knowledge import load_knowledge, save_knowledge
from undertow.control.controllers.robust.memory import TrainingSample, memory
from undertow.control.estimation.fuzzy_system import gaussian_sets
from undertow.control.navigation import perfect
from undertow.control.references import lissajous, sine
from undertow.core.contracts import Target, TrackingError
from undertow.core.measurement import measurement_of_outputs
from undertow.physics.disturbances import none, sinusoid
from undertow.physics.plants import double_integrator, hybrid_vehicle
from undertow.physics.thrusters import t200
from undertow.physics.vehicles import bluerov2_heavy
from undertow.simulation.loop import sampled, simd_batch
from undertow.simulation.loop.closed_loop import ClosedLoop
from undertow.simulation.loop.dataset import to_dataset

pytestmark = pytest.mark.full

DT = 0.02
OBSERVER = Estimator(gaussian_sets(1), bandwidth=8.0, leakage=0.0)
GAINS = OBSERVER.gains(jnp.asarray(DT))
ONE = jnp.ones(())


def observed(rest, error):
    """A step of an observer, for a memory that does not identify inertias."""
    still = jnp.zeros_like(rest)
    return TrainingSample(rest, error, *4 * [still])


def learnt(part, state, regressors, rest_of, free=ONE, error_of=lambda state: jnp.zeros(2)):
    """States over a sequence of regressors; what the observer adds, and its modelling error, are functions of them."""

    def step(state, phi):
        seen = observed(rest_of(state), error_of(state))
        after, gained = part.advance(state, phi, seen, GAINS, free, jnp.asarray(DT))
        return after, (state, gained)

    return jax.jit(lambda state: jax.lax.scan(step, state, regressors))(state)


def motion(seed, count, steps=400):
    return jnp.asarray(np.random.default_rng(seed).normal(size=(steps, count)))


def two_axes(**options):
    return memory(2, regressor="linear", **options)


def test_without_forgetting_the_weights_are_those_of_ridge_regression():
    """Least squares of the observer's estimate on the lagged regressor, solved at once."""
    part = two_axes(horizon=1e12, learning_rate=3.0)
    count = part.size(2, False)
    truth = jnp.asarray(np.random.default_rng(1).uniform(-1, 1, (count, 2)))
    rest = lambda state: (truth - state.weights).T @ state.lagged
    last, (states, _) = learnt(part, part.init(2, False), motion(2, count), rest)
    lagged = np.asarray(states.lagged)
    ridge = np.linalg.solve(DT * lagged.T @ lagged + np.eye(count) / 3.0, DT * lagged.T @ (lagged @ np.asarray(truth)))
    np.testing.assert_allclose(last.weights, ridge, atol=1e-9)
    np.testing.assert_allclose(np.linalg.inv(last.covariance), DT * lagged.T @ lagged + np.eye(count) / 3.0, rtol=1e-8)


def test_covariance_never_grows_and_keeps_the_gain_of_the_horizon():
    """P(k) - P(k + 1) is positive semidefinite; r does not fall below T / horizon for a regressor that is repeated."""
    part = two_axes(horizon=5.0)
    count = part.size(2, False)
    constant = jnp.tile(motion(3, count, 1), (3000, 1))
    last, (states, _) = learnt(part, part.init(2, False), constant, lambda state: jnp.ones(2))
    steps = np.asarray(states.covariance[::100])
    assert np.linalg.eigvalsh(steps[:-1] - steps[1:]).min() > -1e-9
    size = DT * last.lagged @ last.covariance @ last.lagged
    np.testing.assert_allclose(size, DT / 5.0, rtol=0.05)


def test_what_is_not_excited_is_neither_learnt_nor_forgotten():
    part = two_axes()
    start = part.init(2, False)
    start = start._replace(weights=start.weights + 0.7)
    regressors = motion(4, part.size(2, False)).at[:, 3].set(0.0)
    last, _ = learnt(part, start, regressors, lambda state: jnp.ones(2))
    np.testing.assert_array_equal(last.weights[3], start.weights[3])
    np.testing.assert_array_equal(last.covariance[3], start.covariance[3])
    assert np.abs(last.weights - start.weights).max() > 0.1


def test_nothing_is_learnt_while_limits_bind_and_weights_stay_in_their_box():
    part = two_axes(bound=0.05)
    start, regressors = part.init(2, False), motion(5, part.size(2, False))
    limited, _ = learnt(part, start, regressors, lambda state: jnp.ones(2), 0 * ONE)
    np.testing.assert_array_equal(limited.weights, start.weights)
    np.testing.assert_array_equal(limited.covariance, start.covariance)
    free, _ = learnt(part, start, regressors, lambda state: 10 * jnp.ones(2))
    np.testing.assert_allclose(np.abs(free.weights).max(), 0.05)


def test_the_lagged_regressor_is_what_the_observer_makes_of_it():
    """An observer of an uncertainty that equals one entry of the regressor."""
    part = two_axes()
    regressors = motion(6, part.size(2, False), 100)
    last, _ = learnt(part, part.init(2, False), regressors, lambda state: jnp.zeros(2))
    state, velocity = OBSERVER.init(jnp.zeros(1)), jnp.zeros(1)
    for load in regressors[:, 4]:
        seen = OBSERVER.estimate(state, velocity)
        state = OBSERVER.advance(state, seen, jnp.zeros(1), jnp.zeros(1), DT)
        velocity = velocity + DT * load
    np.testing.assert_allclose(state.weights[0, 0], last.lagged[4], atol=1e-9)


def test_the_observer_loses_what_the_memory_gains():
    """The estimate after a step, at the same regressor and modelling error, is that of the step without learning."""
    part = two_axes()
    state, phi = part.init(2, False), motion(7, part.size(2, False), 1)[0]
    state = state._replace(lagged=0.9 * phi)
    observer = OBSERVER.init(jnp.zeros(2))._replace(weights=jnp.asarray([[0.4], [-0.3]]))
    after, gained = part.advance(
        state, phi, observed(jnp.asarray([0.4, -0.3]), jnp.zeros(2)), GAINS, ONE, jnp.asarray(DT)
    )
    lowered = OBSERVER.lowered(observer, gained)
    total = part.recalled(after, phi) + lowered.weights[:, 0]
    assert np.abs(gained).min() > 1e-3
    np.testing.assert_allclose(total, part.recalled(state, phi) + observer.weights[:, 0], atol=1e-12)


@pytest.mark.parametrize("regressor", ["both", "rules", "linear"])
def test_the_regressor_is_that_of_the_reference_wherever_the_vehicle_is(regressor):
    """The body axes of a vehicle that is displaced and moves otherwise, in the attitude of the reference."""
    part, model = memory(6, regressor=regressor), hybrid_vehicle(bluerov2_heavy(), t200()).model().in_body_axes()
    target = Target(*(jnp.asarray(np.random.default_rng(8).uniform(-0.3, 0.3, 6)) for _ in range(3)))
    found = []
    for offset, rate in ((0.0, 0.0), (0.4, 0.3)):
        position, velocity = target.position.at[:3].add(offset), target.velocity.at[:3].add(rate)
        y = measurement_of_outputs(position, velocity)
        off = TrackingError(*model.coordinates.tracking_error(y, target))
        found.append(part.regressors(y, model.coordinates.velocity(y), off, True))
    assert found[0].shape == (part.size(6, True),)
    np.testing.assert_allclose(found[0], found[1], atol=1e-12)


def loop_of(law):
    plant = double_integrator(1)
    return ClosedLoop(plant, law, sine(0.5, 1.0), sinusoid(0.8, 1.0, phase=0.3), perfect())


@pytest.fixture(scope="module")
def dive():
    """A load that repeats with the reference."""
    plant = double_integrator(1)
    law = rcaf(plant.model(), preset="learning", sampling_time=DT, bandwidth=4.0, tracking=2.0, regressor="linear")
    loop = loop_of(law)
    return loop, simd_batch.simulate(loop, duration=60.0, dt=DT, record_every=5)


def test_a_load_that_repeats_is_learnt_and_the_batch_compiler_gives_the_run_of_xla(dive):
    loop, one = dive
    other = sampled.simulate(loop, duration=60.0, dt=DT, record_every=5)
    np.testing.assert_allclose(one.signals["error"], other.signals["error"], rtol=1e-6, atol=1e-9)
    error = np.abs(np.asarray(one.signals["error"])[:, 0])
    without = rcaf(loop.plant.model(), preset="robust", sampling_time=DT, bandwidth=4.0, tracking=2.0)
    plain = simd_batch.simulate(loop_of(without), duration=60.0, dt=DT, record_every=5)
    assert error[-63:].max() < 0.1 * np.abs(np.asarray(plain.signals["error"])[-63:, 0]).max()


def test_knowledge_is_saved_and_the_next_run_begins_with_it(dive, tmp_path):
    loop, one = dive
    file = tmp_path / "learnt.npz"
    save_knowledge(file, to_dataset(one, loop))
    weights, variance = load_knowledge(file)[:2]
    np.testing.assert_array_equal(weights, one.signals["memory_weights"][-1])
    np.testing.assert_array_equal(variance, one.signals["memory_variance"][-1])
    options = {"preset": "learning", "sampling_time": DT, "bandwidth": 4.0, "tracking": 2.0, "regressor": "linear"}
    again = loop_of(rcaf(loop.plant.model(), knowledge=str(file), **options))
    found = simd_batch.simulate(again, duration=60.0, dt=DT, record_every=5)
    np.testing.assert_array_equal(found.signals["memory_weights"][0], weights)
    np.testing.assert_allclose(found.signals["memory_variance"][0], variance, rtol=1e-12)


@pytest.mark.slow
def test_second_lap_of_a_vehicle_with_a_wrong_model():
    """BlueROV2 Heavy with another published model, 50 Hz: position and attitude below 0.4 times those of `robust`."""
    plant = hybrid_vehicle(bluerov2_heavy(), t200(supply=16.0), ledger=False)
    model = plant.model(vehicle=bluerov2_heavy("wu2018"), rate_term=True)
    lap, found = 40 * np.pi, {}
    for preset in ("robust", "learning"):
        law = rcaf(model, preset=preset, sampling_time=DT)
        motion = lissajous([2.0, 1.0, 0.5, 0.8], [0.2, 0.4, 0.3, 0.25])
        run = simd_batch.simulate(ClosedLoop(plant, law, motion, none(), perfect()), duration=252.0, dt=DT)
        off = np.asarray(run.signals["error"])[np.asarray(run.time) > lap]
        found[preset] = np.array([np.sqrt((off[:, part] ** 2).sum(1).mean()) for part in (slice(3), slice(3, 6))])
    assert (found["learning"] < 0.4 * found["robust"]).all()
