"""When sensors speak and how wrong they are; what the observer makes of it. Closed forms throughout."""

from typing import NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from textbook import wrap_angle

from undertow.control.navigation.observer import observer
from undertow.core.contracts import Measurement
from undertow.core.errors import BadInput
from undertow.core.measurement import measurement_of_outputs
from undertow.physics.sensors import compass, depth, dvl, imu, position_fix, propeller_speed
from undertow.physics.sensors.sampling import Sampling
from undertow.physics.thrusters.thruster import PropellerReport

QUIET_IMU = {"angle_noise": 0.0, "rate_noise": 0.0, "force_noise": 0.0}


def itself(t):
    return jnp.stack([t])


def zero(t):
    return jnp.zeros(1)


@eqx.filter_jit
def delivered(sampling, times, truth, key):
    """Readings of a sensor at these times, and whether each is new."""

    def advance(state, t):
        chance = jax.random.normal(jax.random.fold_in(key, sampling.number(t)), (2,))
        arrival, state = sampling.deliver(state, t, truth(t), chance)
        return state, arrival

    arrivals = jax.lax.scan(advance, sampling.init(jnp.zeros(1), jnp.ones(1)), times)[1]
    return arrivals.reading[:, 0], arrivals.fresh


def readings_of(sampling, step, duration, truth=itself, key=0):
    """Instants, readings and freshness of a sensor that is asked every `step` seconds."""
    steps = round(duration / step)
    times = np.arange(max(steps, 800)) * step  # as many for all short runs, which are one program then
    readings, fresh = delivered(sampling, times, truth, jax.random.PRNGKey(key))
    return times[:steps], np.asarray(readings)[:steps], np.asarray(fresh)[:steps]


def test_readings_come_at_the_period_and_are_as_old_as_the_delay():
    """The truth is the time itself, so a reading tells when it was taken."""
    times, readings, fresh = readings_of(Sampling(0.05, delay=0.12), 0.01, 2.0)
    np.testing.assert_allclose(times[fresh], np.arange(38) * 0.05 + 0.12, atol=1e-12)
    np.testing.assert_allclose(readings[fresh], np.arange(38) * 0.05, atol=1e-12)


def test_a_period_between_ticks_waits_for_the_next_tick():
    times, readings, fresh = readings_of(Sampling(0.015), 0.01, 0.1)
    np.testing.assert_allclose(times[fresh], [0.0, 0.02, 0.03, 0.05, 0.06, 0.08, 0.09], atol=1e-12)
    np.testing.assert_array_equal(readings[fresh], times[fresh])


def test_faster_than_the_loop_the_newest_is_heard():
    times, readings, fresh = readings_of(Sampling(0.01, delay=0.03), 0.05, 1.0)
    assert fresh[1:].all() and not fresh[0]
    # Sample (t - delay) falls between two steps and is answered with the truth at the step after it.
    np.testing.assert_allclose(readings[fresh], times[fresh], atol=1e-12)


def test_resolution_rounds_to_the_nearest_step():
    _, readings, _ = readings_of(Sampling(0.01, resolution=0.25), 0.01, 1.0)
    np.testing.assert_array_equal(readings, np.round(np.arange(100) * 0.01 / 0.25) * 0.25)


def test_bias_is_one_number_per_run():
    _, readings, _ = readings_of(Sampling(0.01, bias=0.3), 0.01, 0.5, zero)
    np.testing.assert_allclose(readings, 0.3, rtol=1e-15)


def test_noise_belongs_to_the_sample_not_to_the_loop():
    sampling = Sampling(0.02, noise=0.5)
    _, slow, when_slow = readings_of(sampling, 0.02, 4.0, zero)
    _, fast, when_fast = readings_of(sampling, 0.005, 4.0, zero)
    np.testing.assert_array_equal(slow[when_slow], fast[when_fast])


@pytest.mark.full
def test_noise_and_dropout_have_the_stated_statistics():
    _, readings, fresh = readings_of(Sampling(0.01, noise=0.5, dropout=0.3), 0.01, 200.0, zero)
    kept, n = readings[fresh], len(fresh)
    assert abs(fresh.mean() - 0.7) < 4 * np.sqrt(0.21 / n)
    assert abs(kept.mean()) < 4 * 0.5 / np.sqrt(len(kept))
    assert abs(kept.std() / 0.5 - 1) < 4 / np.sqrt(2 * len(kept))
    assert abs((kept[1:] * kept[:-1]).mean()) < 4 * 0.25 / np.sqrt(len(kept))


@pytest.mark.parametrize(
    "wrong, name",
    [
        ({"period": 0.0}, "period"),
        ({"dropout": 1.0}, "dropout"),
        ({"noise": -1.0}, "noise"),
        ({"delay": float("nan")}, "delay"),
    ],
)
def test_impossible_instruments(wrong, name):
    with pytest.raises(BadInput, match=name):
        dvl(**wrong)


# The observer. A body swings in all six outputs, smoothly; its truth is a closed form.

AMPLITUDE = np.array([1.0, 0.7, 0.4, 0.3, 0.2, 0.5])
FREQUENCY = np.array([0.3, 0.5, 0.4, 0.7, 0.6, 0.2])


def swinging(t):
    return measurement_of_outputs(AMPLITUDE * jnp.sin(FREQUENCY * t), AMPLITUDE * FREQUENCY * jnp.cos(FREQUENCY * t))


class Moving(NamedTuple):
    """Outputs that begin somewhere, change steadily, and swing."""

    start: np.ndarray = np.zeros(6)
    rates: np.ndarray = np.zeros(6)
    size: float = 0.0

    def at(self, t):
        swing = swinging(t)
        outputs = self.start + self.rates * t + self.size * swing.position
        return measurement_of_outputs(outputs, self.rates + self.size * swing.velocity)


STILL = Moving(start=np.array([1.0, 2.0, 3.0, 0.1, -0.2, 2.5]))
LEVEL = Moving()
BLOCK = 1000  # steps of a program that runs of any length repeat


@eqx.filter_jit
def observe(sensor, motion, steps, step, key):
    """Estimated and true measurements at every step."""
    path = sensor.realize(key)

    def advance(state, k):
        truth = motion(k * step)
        told, state = sensor.measure(path, state, k * step, truth)
        return state, (told, truth)

    return jax.lax.scan(advance, sensor.init(path, motion(0.0)), jnp.arange(steps, dtype=float))[1]


@eqx.filter_jit
def observed(sensor, motion, first, step, key, state):
    """State after `BLOCK` steps, and the errors of position and velocity in them."""
    path = sensor.realize(key)

    def advance(state, k):
        truth = motion.at(k * step)
        measured, state = sensor.measure(path, state, k * step, truth)
        apart = measured.position - truth.position
        apart = apart.at[3:].set(wrap_angle(apart[3:]))
        return state, jnp.concatenate([apart, measured.velocity - truth.velocity])

    return jax.lax.scan(advance, state, first + jnp.arange(BLOCK, dtype=float))


@eqx.filter_jit
def largest_errors(sensor, motion, steps, step):
    """Largest errors of position and velocity, [12]; one program for all numbers of steps and all numbers in sensors."""
    path = sensor.realize(jax.random.PRNGKey(0))

    def advance(k, carry):
        state, largest = carry
        truth = motion(k * step)
        told, state = sensor.measure(path, state, k * step, truth)
        apart = told.position - truth.position
        apart = apart.at[3:].set(wrap_angle(apart[3:]))
        return state, jnp.maximum(largest, jnp.abs(jnp.concatenate([apart, told.velocity - truth.velocity])))

    return jax.lax.fori_loop(0, steps, advance, (sensor.init(path, motion(0.0)), jnp.zeros(12)))[1]


def largest(sensors, step):
    """Largest errors of `swinging` over 20 s."""
    return np.asarray(largest_errors(observer(sensors), swinging, np.asarray(round(20.0 / step)), np.asarray(step)))


@eqx.filter_jit
def begun(sensor, motion, key):
    """State of navigation at the start."""
    return sensor.init(sensor.realize(key), motion.at(0.0))


def errors(sensors, motion, step, duration, key=0, **blends):
    """Errors of position and velocity at every step, [t, 12]."""
    sensor, steps, found = observer(sensors, **blends), round(duration / step), []
    motion = Moving(*(np.asarray(one) for one in motion))
    state = jax.tree.map(np.asarray, begun(sensor, motion, jax.random.PRNGKey(key)))
    for first in range(0, steps, BLOCK):
        at = np.asarray(float(first)), np.asarray(step)
        state, block = observed(sensor, motion, *at, jax.random.PRNGKey(key), state)
        found.append(np.asarray(block))
    return np.concatenate(found)[:steps]


@pytest.mark.full
def test_a_still_vehicle_with_perfect_instruments_is_known_exactly():
    quiet = [imu(**QUIET_IMU), dvl(noise=0, resolution=0), depth(noise=0, resolution=0), compass(noise=0)]
    assert np.abs(errors([*quiet, position_fix(noise=0)], STILL, 0.01, 20.0)).max() < 1e-12


@pytest.mark.full
def test_the_observer_converges_at_second_order_when_corrected_at_every_tick():
    """One prediction is off by the square of the step, and each correction takes away the same share of what is left."""
    found = []
    for step in (0.02, 0.01, 0.005):
        period = {"period": step}
        exact = {"noise": 0.0, "delay": 0.0} | period
        parts = [imu(**QUIET_IMU, **period), dvl(resolution=0, **exact), depth(resolution=0, **exact), compass(**exact)]
        found.append(largest([*parts, position_fix(**exact)], step).max())
    ratios = np.array(found[:-1]) / np.array(found[1:])
    assert ((ratios > 3.9) & (ratios < 4.1)).all(), (found, ratios)
    assert found[-1] < 1e-4


@pytest.mark.full
def test_dead_reckoning_converges_at_first_order():
    """Inertial navigation alone, without noise: 20 s of it are off by millimetres at 1 kHz, and half of it at 2 kHz."""
    far = [largest([imu(period=step, **QUIET_IMU)], step)[:3].max() for step in (1e-3, 5e-4)]
    assert far[0] < 0.02
    assert 1.9 < far[0] / far[1] < 2.1


@pytest.mark.full
def test_noise_of_the_dvl_is_smoothed_as_an_exponential_filter_does():
    """Variance alpha / (2 - alpha) of that of the reading."""
    alpha, sigma = 0.3, 0.02
    parts = [imu(**QUIET_IMU), dvl(period=0.01, noise=sigma, resolution=0, delay=0), compass(noise=0)]
    velocity = errors(parts, STILL, 0.01, 400.0, dvl_blend=alpha)[1000:, 6:9]
    expected = sigma * np.sqrt(alpha / (2 - alpha))
    # Effective number of independent samples: a third of 39 000 per (2 - alpha) / alpha.
    assert abs(np.sqrt((velocity**2).mean()) / expected - 1) < 4 / np.sqrt(2 * 3 * 39_000 * alpha / (2 - alpha))


@pytest.mark.full
def test_noise_of_fixes_is_smoothed_as_an_alpha_beta_filter_does():
    """Steady variances of position and velocity of the alpha-beta filter. Bar-Shalom et al. (2001), section 6.5."""
    alpha, sigma, period = 0.2, 0.05, 0.1
    beta = alpha**2 / (2 - alpha)
    parts = [imu(**QUIET_IMU), compass(noise=0), position_fix(period, sigma, delay=0.0)]
    found = errors(parts, STILL, period, 4000.0, fix_blend=alpha)[400:]
    denominator = alpha * (4 - 2 * alpha - beta)
    position = (2 * alpha**2 + beta * (2 - 3 * alpha)) / denominator
    velocity = 2 * beta**2 / denominator / period**2
    np.testing.assert_allclose((found[:, :2] ** 2).mean(), position * sigma**2, rtol=0.05)
    np.testing.assert_allclose((found[:, 6:8] ** 2).mean(), velocity * sigma**2, rtol=0.05)


@pytest.mark.full
def test_delays_do_not_matter_at_constant_velocity():
    steady = Moving(rates=np.array([0.5, -0.3, 0.1, 0.0, 0.0, 0.2]))
    late = {"delay": 0.4, "noise": 0.0}
    parts = [imu(**QUIET_IMU), depth(resolution=0, **late), compass(**late), position_fix(**late)]
    found = np.abs(errors(parts, steady, 0.01, 30.0))
    assert found[:, [0, 1, 2, 3, 4, 6, 7, 8, 9, 10, 11]].max() < 1e-9
    # The quaternion turns by 2 atan(w T / 2) a step instead of w T; 0.05 of it is corrected every fifth step.
    left = 5 * (0.2 * 0.01) ** 3 / 12 / 0.05
    np.testing.assert_allclose(found[-1000:, 5].max(), left, rtol=0.05)


@pytest.mark.full
def test_a_tilted_accelerometer_leaks_gravity_until_the_dvl_speaks():
    """An offset of b in acceleration grows to b T / alpha between corrections of share alpha every T."""
    offset, period, alpha = 0.01, 0.2, 0.4
    key = 5
    parts = [imu(**QUIET_IMU, force_bias=offset), dvl(period=period, noise=0, resolution=0, delay=0), compass(noise=0)]
    sensor = observer(parts, dvl_blend=alpha)
    realization = begun(sensor, LEVEL, jax.random.PRNGKey(key)).sensors[0].offset[5:]
    velocity = errors(parts, LEVEL, 0.01, 40.0, key, dvl_blend=alpha)[2000:, 6:9]
    before_correction = np.abs(velocity).max(0)
    expected = np.abs(np.asarray(realization)) * period / alpha * (1 - alpha)
    # The largest value that is reported is the one a step before the correction.
    expected += np.abs(np.asarray(realization)) * (period - 0.01)
    np.testing.assert_allclose(before_correction, expected, rtol=1e-6)


@pytest.mark.full
@pytest.mark.parametrize("rate", [jnp.zeros(2), None], ids=["with its rate", "alone"])
def test_propeller_speed_and_its_rate(rate):
    """A propeller that speeds up steadily: speed as read, rate from two readings where thrusters report one."""

    def motion(t):
        return measurement_of_outputs(jnp.zeros(6), jnp.zeros(6), PropellerReport(jnp.array([3.0, -2.0]) * t, rate))

    parts = [imu(**QUIET_IMU), propeller_speed(noise=0)]
    told, truth = observe(observer(parts), motion, 100, 0.01, jax.random.PRNGKey(0))
    np.testing.assert_allclose(told.actuator.speed, truth.actuator.speed, atol=1e-12)
    if rate is None:
        assert told.actuator.acceleration is None
    else:
        np.testing.assert_allclose(told.actuator.acceleration[2:], np.array([[3.0, -2.0]] * 98), rtol=1e-9)


@pytest.mark.full
def test_the_same_key_gives_the_same_bits():
    run = lambda key: errors(
        [imu(), dvl(dropout=0.2), depth(), compass(), position_fix()], Moving(size=1.0), 0.01, 3.0, key
    )
    once, again, other = run(7), run(7), run(8)
    np.testing.assert_array_equal(once, again)
    assert (np.abs(once - other).max(0) > 0).all()


def test_an_imu_is_needed():
    with pytest.raises(BadInput, match="IMU among them"):
        observer([dvl(), depth()])


def test_only_vehicles_navigate():
    with pytest.raises(BadInput, match="a plant of 1 output"):
        sensor = observer([imu()])
        sensor.init(sensor.realize(jax.random.PRNGKey(0)), Measurement(jnp.zeros(1), jnp.zeros(1)))
