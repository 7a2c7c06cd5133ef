"""Inertia from the response to a probing oscillation: closed forms, its standard error, and a vehicle with a wrong model."""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest

from undertow.analysis.certificate.function import estimation_bound, fastest_uncertainty
from undertow.control.controllers import rcaf
from undertow.control.controllers.robust.estimator import Estimator
from undertow.control.controllers.robust.inertia import InertiaIdentification
from undertow.control.controllers.robust.memory import TrainingSample, memory
from undertow.control.estimation.fuzzy_system import gaussian_sets
from undertow.control.navigation import perfect
from undertow.control.references import lissajous
from undertow.physics.disturbances import none
from undertow.physics.plants import hybrid_vehicle
from undertow.physics.thrusters import t200
from undertow.physics.vehicles import bluerov2_heavy
from undertow.simulation.loop import simd_batch
from undertow.simulation.loop.closed_loop import ClosedLoop
from undertow.simulation.loop.dataset import to_dataset

pytestmark = pytest.mark.full

DT = 0.01
ERROR = 1.0  # rad: large enough not to limit the oscillation


def part(axes=2, **options):
    return InertiaIdentification(amplitude=jnp.full(axes, 0.1), frequency=jnp.linspace(5.0, 6.0, axes), **options)


@eqx.filter_jit
def identified(one, inertia, drag, noise):
    """State after a vehicle whose motion is that of the probing target, with `noise` in the applied acceleration."""

    def step(state, extra):
        _, rate, _ = one.motion(state)
        late = state._replace(angle=state.angle + one.frequency * DT / 2)  # the mean over a step is that of its middle
        _, middle, acceleration = one.motion(late)
        nominal = inertia * acceleration + drag * middle + extra
        return one.advance(state, ERROR, rate, nominal, 1.0, DT), None

    return jax.lax.scan(step, one.init(len(inertia)), noise)[0]


@pytest.mark.parametrize("inertia", [(2.0, 0.6), (1.0, 1.4)])
def test_the_ratio_of_inertias_is_found_whatever_the_drag_is(inertia):
    one = part(plausible=1e3)
    state = identified(one, jnp.asarray(inertia), jnp.asarray([0.8, -0.5]), jnp.zeros((9000, 2)))
    left = 1 / (one.frequency * state.counted)  # of the oscillation at twice the frequency that demodulation adds
    assert (np.abs(one.ratio(state) / jnp.asarray(inertia) - 1) < left).all()
    # Before its first window ended it did not know them.
    windows = np.asarray(state.counted) / 10.0
    unseen, surprise = windows**-2, np.abs(np.asarray([inertia, (0.8, 0.5)])).max(0) / windows
    assert ((unseen <= one.error(state)) & (one.error(state) < np.hypot(unseen, surprise))).all()


def test_the_standard_error_is_the_scatter_over_noises():
    """White noise of 1 m/s^2 in each step: real parts of the transfer over 64 runs against the mean of `error`."""
    one = part(2, plausible=1e3, window=2.0)
    noise = jnp.asarray(np.random.default_rng(0).normal(size=(64, 9000, 2)))
    found = jax.vmap(lambda each: identified(one, jnp.ones(2), jnp.zeros(2), each))(noise)
    ratios, errors = (np.asarray(jax.vmap(rule)(found)) for rule in (one.ratio, one.error))
    seen = np.sqrt((errors**2 - (2.0 / np.asarray(found.counted)) ** 4).mean(0))
    np.testing.assert_allclose(seen, ratios.std(0), rtol=0.3)
    assert np.abs(ratios.mean(0) - 1).max() < 4 * ratios.std(0).max() / 8


def test_noise_that_hides_the_response_leaves_the_nominal_inertia():
    """Used is h shrunk towards 1 by its standard error."""
    noise = 30 * jnp.asarray(np.random.default_rng(1).normal(size=(9000, 2)))
    one = part()
    state = identified(one, jnp.asarray([2.0, 2.0]), jnp.zeros(2), noise)
    assert np.asarray(one.error(state)).min() > 0.5
    assert np.abs(np.asarray(one.ratio(state)) - 1).max() < 0.4


def test_probing_ends_and_begins_gently_again():
    """Information t_p obeys dt_p/dt = 1 - t_p / duration - t_p / horizon."""
    one = part(duration=20.0, horizon=200.0)
    state = identified(one, jnp.ones(2), jnp.zeros(2), jnp.zeros((30000, 2)))
    np.testing.assert_allclose(state.time, 1 / (1 / 20 + 1 / 200), rtol=1e-3)
    size = np.sqrt(1 - np.asarray(state.time) / 20.0) * 0.1
    _, rate, acceleration = one.motion(state)
    np.testing.assert_allclose(np.hypot(acceleration, rate * one.frequency), size, rtol=1e-9)


def test_an_axis_that_is_not_probed_keeps_its_inertia():
    one = InertiaIdentification(amplitude=jnp.asarray([0.0, 0.1]), frequency=jnp.asarray([5.0, 6.0]))
    state = identified(one, jnp.asarray([2.0, 2.0]), jnp.zeros(2), jnp.zeros((9000, 2)))
    assert one.ratio(state)[0] == 1.0
    assert one.error(state)[0] == 1000.0
    assert one.ratio(state)[1] > 1.8


def test_what_is_expected_is_used_at_once_and_without_probing():
    expected = jnp.asarray([1.6, 0.7])
    one = part(expected=expected)
    np.testing.assert_allclose(one.ratio(one.init(2)), expected, rtol=1e-6)
    still = InertiaIdentification(amplitude=jnp.zeros(2), frequency=one.frequency, expected=expected)
    after = identified(still, jnp.asarray([1.0, 1.0]), jnp.zeros(2), jnp.zeros((9000, 2)))
    np.testing.assert_array_equal(still.ratio(after), expected)
    np.testing.assert_array_equal(still.motion(after), np.zeros((3, 2)))


def test_what_is_expected_and_wrong_is_corrected():
    one = part(expected=jnp.asarray([2.5, 0.4]))
    found = one.ratio(identified(one, jnp.asarray([1.0, 1.5]), jnp.zeros(2), jnp.zeros((9000, 2))))
    np.testing.assert_allclose(found, [1.0, 1.5], atol=0.05)


def test_probing_is_a_share_of_the_error():
    """An error of 1 mrad besides the oscillation: an amplitude of 0.3 mrad, without the share that time leaves."""
    one = part(duration=1e9)
    step = lambda state, _: (one.advance(state, 1e-3 - one.motion(state)[0], jnp.zeros(2), jnp.zeros(2), 1.0, DT), None)
    state, _ = jax.lax.scan(step, one.init(2), None, length=20000)
    displacement, rate, _ = one.motion(state)
    np.testing.assert_allclose(np.hypot(displacement, rate / one.frequency), 3e-4, rtol=1e-3)
    np.testing.assert_array_equal(part().motion(part().init(2)), np.zeros((3, 2)))


def test_a_sudden_load_is_no_inertia():
    """For 0.3 s the applied acceleration is 80 times that of the oscillation: a tenth of its effect remains."""
    one, steps = part(), np.arange(6000)
    sudden = np.where((steps >= 3300) & (steps < 3330), 8.0, 0.0)
    state = identified(one, jnp.ones(2), jnp.zeros(2), jnp.asarray(np.stack([sudden, sudden], 1)))
    around = np.exp(-1j * np.asarray(one.frequency) * (steps[:, None] + 0.5) * DT)
    share = np.exp(-steps * DT / 2 / 60.0)  # dt_p/dt = 1 - t_p / duration, and share^2 = 1 - t_p / duration
    unweighted = np.abs((sudden[:, None] * around).sum(0)) / (0.05 * share.sum()) * share[3315]
    assert unweighted.min() > 0.5
    assert (np.abs(one.ratio(state) - 1) < unweighted / 10).all()


def test_a_vehicle_with_less_inertia_than_its_model_is_not_corrected_less():
    one = part()
    state = identified(one, jnp.asarray([0.5, 2.0]), jnp.zeros(2), jnp.zeros((9000, 2)))
    np.testing.assert_array_equal(one.used(state), [1.0, one.ratio(state)[1]])
    assert one.ratio(state)[0] < 0.6


def test_the_command_does_not_jump_when_the_inertia_changes():
    """What is desired less what is estimated, at the same feedback, before and after a step that learns."""
    one = part(expected=jnp.asarray([1.5, 1.2]))
    law = memory(2, regressor="linear", inertia=one)
    state = law.init(2, False)
    window = identified(one, jnp.asarray([1.2, 1.8]), jnp.zeros(2), jnp.zeros((2999, 2)))
    state = state._replace(weights=state.weights + 0.3, lagged=state.lagged + 0.5)
    state = state._replace(inertia=window._replace(since=jnp.asarray(one.window)))
    rest, beside = jnp.asarray([0.4, -0.3]), jnp.asarray([1.2, 0.8])
    off = jnp.asarray([0.05, 0.02])
    seen = TrainingSample(
        rest, jnp.asarray([0.1, 0.2]), off, beside - rest, jnp.asarray([0.3, -0.2]), jnp.asarray([5.0, 7.0])
    )
    gains, phi = Estimator(gaussian_sets(1), bandwidth=8.0).gains(jnp.asarray(DT)), 0.5 + state.lagged
    after, lost = law.advance(state, phi, seen, gains, jnp.ones(()), jnp.asarray(DT))
    assert np.abs(law.inertia_ratio(after) - law.inertia_ratio(state)).min() > 1e-4
    before = law.value(state, phi, beside - rest) + rest
    np.testing.assert_allclose(law.value(after, phi, beside - rest + lost) + rest - lost, before, rtol=1e-12)


@pytest.mark.slow
def test_a_vehicle_with_a_wrong_model_finds_its_inertia_and_keeps_its_bound():
    """BlueROV2 Heavy, true moments of inertia 1.59, 1.30 and 2.11 times those of its model wu2018, 100 Hz."""
    plant = hybrid_vehicle(bluerov2_heavy(), t200(supply=16.0), ledger=False)
    law = rcaf(plant.model(vehicle=bluerov2_heavy("wu2018"), rate_term=True), preset="learning", sampling_time=DT)
    loop = ClosedLoop(plant, law, lissajous([2.0, 1.0, 0.5, 0.8], [0.2, 0.4, 0.3, 0.25]), none(), perfect())
    run = to_dataset(simd_batch.simulate(loop, duration=120.0, dt=DT, record_every=1), loop)
    np.testing.assert_allclose(run["inertia"].values[-1], [1, 1, 1, 1.59, 1.30, 2.11], rtol=0.12)
    late = run.isel(time=run["time"].values > 20.0)
    error = np.abs(late["estimate"].values - late["uncertainty"].values)
    assert (error <= estimation_bound(law.estimator, DT, fastest_uncertainty(late)) + 1e-9).all()
