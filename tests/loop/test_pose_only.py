"""Observer of velocity from the pose: its lag and its noise are those of closed forms, and the law's error has both."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from undertow.control.navigation.pose_only import PoseOnly, PoseOnlyState, pose_only
from undertow.core.contracts import Measurement
from undertow.core.errors import BadInput
from undertow.core.measurement import measurement_of_outputs

T = 0.01


@jax.jit
def estimates(filter_, positions):
    """Estimates along a motion of one output, (steps,) each."""
    key = filter_.realize(jax.random.PRNGKey(3))
    truth = lambda position: Measurement(position[None], jnp.zeros(1))

    def step(state, instant):
        k, position = instant
        y, state = filter_.measure(key, state, k * T, truth(position))
        return state, (y.position[0], y.velocity[0], state.acceleration[0])

    start = filter_.init(key, truth(positions[0]))
    return jax.lax.scan(step, start, (jnp.arange(float(len(positions))), positions))[1]


@pytest.mark.parametrize("order", [2, 3])
def test_lag_at_constant_acceleration_or_jerk(order):
    """2 a / w with order 2, 3 j / w^2 with order 3, in the limit of short sampling times; nothing of lower order."""
    w, size, times = 8.0, 0.7, T * np.arange(1000)
    filter_ = pose_only(bandwidth=w, order=order, sampling_time=T)
    velocities = lambda motion: np.asarray(estimates(filter_, motion(times))[1])
    motion = lambda t: 0.3 + size * t**order / {2: 2, 3: 6}[order]
    t = times[399]
    velocity = size * t ** (order - 1) / {2: 1, 3: 2}[order]
    late = {2: 2 * size / w, 3: 3 * size / w**2}[order]
    assert velocity - velocities(motion)[399] == pytest.approx(late, rel=1.5 * w * T)
    slower = lambda t: 0.3 - 0.4 * t ** (order - 1)
    off = velocities(slower)[-1] + 0.4 * (order - 1) * times[-1] ** (order - 2)
    assert abs(off) < 1e-9


@pytest.mark.parametrize("order", [2, 3])
def test_poles_are_those_of_the_bandwidth(order):
    """The matrix of one step without noise has its eigenvalues at exp(-w T), as often as the order says."""
    filter_ = pose_only(bandwidth=30.0, order=order, sampling_time=T)
    truth = Measurement(np.zeros(1), np.zeros(1))

    def step(x):
        state = PoseOnlyState(*[x[i : i + 1] for i in range(3)], jnp.asarray(5))
        after = filter_.measure(jax.random.PRNGKey(0), state, 0.0, truth)[1]
        return jnp.concatenate(after[:3])

    matrix = np.asarray(jax.jit(jax.jacfwd(step))(np.zeros(3)))[:order, :order]
    expected = np.poly(np.full(order, np.exp(-30.0 * T)))
    np.testing.assert_allclose(np.poly(matrix), expected, rtol=1e-12)


noise_of = jax.jit(PoseOnly.velocity_noise)


@pytest.mark.parametrize("order", [2, 3])
@pytest.mark.parametrize("w", [3.0, 40.0])
def test_declared_noise_is_that_of_the_estimate(order, w):
    """Closed form = variance of the linear recursion, by its Lyapunov equation; and that of a run."""
    from scipy.linalg import solve_discrete_lyapunov

    filter_ = pose_only(noise=0.02, bandwidth=w, order=order, sampling_time=T)
    kept = np.exp(-w * T)
    gain = {
        2: [1 - kept**2, (1 - kept) ** 2 / T],
        3: [1 - kept**3, 1.5 * (1 - kept) ** 2 * (1 + kept) / T, (1 - kept) ** 3 / T**2],
    }[order]
    predict = np.array([[1, T, T**2 / 2], [0, 1, T], [0, 0, 1]])[:order, :order]
    closed = (np.eye(order) - np.outer(gain, np.eye(order)[0])) @ predict
    variance = solve_discrete_lyapunov(closed, 0.02**2 * np.outer(gain, gain))[1, 1]
    assert float(noise_of(filter_, T)) == pytest.approx(np.sqrt(variance), rel=1e-10)
    run = np.asarray(estimates(filter_, np.zeros(40_000))[1])[2000:]
    assert run.std() == pytest.approx(np.sqrt(variance), rel=0.06)


def test_noise_of_a_fast_sampled_observer():
    """s (w^3 T / 4)^(1/2) and s (7 w^3 T / 4)^(1/2), which the docstring gives."""
    for order, factor in ((2, 0.25), (3, 1.75)):
        found = noise_of(pose_only(noise=0.5, bandwidth=2.0, order=order, sampling_time=1e-4), 1e-4)
        assert float(found) == pytest.approx(0.5 * np.sqrt(factor * 8.0 * 1e-4), rel=1e-3)


def test_angles_of_a_vehicle_are_compared_the_short_way_round():
    """A yaw that passes pi goes on at its rate, and positions have no shorter way; the first reading is the true pose."""
    filter_ = pose_only(bandwidth=25.0, sampling_time=T)
    times, poses = T * np.arange(150), np.tile([1.0, 2, 3, 0, 0, 0], (150, 1))
    poses[50:, :3] += [4.0, -5.0, 6.0]
    poses[:, 5] = np.mod(3.0 + 0.5 * times + np.pi, 2 * np.pi) - np.pi

    @jax.jit
    def measured(times, poses):
        key, at = jax.random.PRNGKey(0), lambda pose: measurement_of_outputs(pose, jnp.zeros(6))
        step = lambda state, instant: filter_.measure(key, state, instant[0], at(instant[1]))[::-1]
        return jax.lax.scan(step, filter_.init((), at(poses[0])), (times, poses))[1]

    y = measured(times, poses)
    np.testing.assert_allclose(np.asarray(y.position)[0], poses[0], atol=1e-15)
    np.testing.assert_allclose(np.asarray(y.position)[-1, :3], poses[-1, :3], atol=1e-6)
    assert np.asarray(y.velocity)[-1, 5] == pytest.approx(0.5, abs=1e-3)
    assert y.body is not None and np.asarray(y.body.nu)[-1, 5] == pytest.approx(0.5, abs=1e-3)


@pytest.mark.parametrize(
    "options",
    [{"order": 4}, {"bandwidth": 0.0}, {"noise": -0.1}, {"sampling_time": 0.0}],
    ids=lambda one: next(iter(one)),
)
def test_bad_options(options):
    with pytest.raises(BadInput, match=next(iter(options))):
        pose_only(**options)
