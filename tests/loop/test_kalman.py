"""The error-state Kalman filter: against textbook matrices, consistent with its covariance, late and wrong readings."""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from jaxtyping import Float
from recorded import is_as_recorded
from scipy.linalg import expm
from scipy.spatial.transform import Rotation
from textbook import rotation_from_euler

import undertow as ut
from undertow.control.navigation.kalman import ATTITUDE, FORCE_BIAS, GYRO_BIAS, POSITION, VELOCITY, Kalman, kalman
from undertow.control.navigation.observability import Sensed, deviations, unobservable
from undertow.core.errors import BadInput
from undertow.core.measurement import measurement_of_outputs
from undertow.core.param import Param, param
from undertow.physics.sensors import compass, depth, dvl, imu, position_fix
from undertow.physics.sensors.imu import IMU
from undertow.physics.sensors.received import Received
from undertow.physics.sensors.sampling import Sampling
from undertow.physics.sensors.sensor import AbstractSensor

AMPLITUDE = np.array([1.0, 0.7, 0.4, 0.3, 0.2, 0.5])
FREQUENCY = np.array([0.3, 0.5, 0.4, 0.7, 0.6, 0.2])
BIASES = {"rate_bias": 5e-3, "force_bias": 0.05}
ALL = [imu(**BIASES), dvl(), depth(), compass(), position_fix()]


def outputs(t, size=1.0, numbers=jnp):
    """Position and velocity of a body that swings."""
    position, velocity = numbers.sin(FREQUENCY * t), FREQUENCY * numbers.cos(FREQUENCY * t)
    return size * AMPLITUDE * position, size * AMPLITUDE * velocity


def swinging(t, size=1.0):
    return measurement_of_outputs(*outputs(t, size))


STEP, BLOCK = 0.01, 500  # s; steps of a program that runs of any length repeat


def followed(navigation, size, steps, keys):
    """Errors of every state at every step, [keys, steps, 15], of runs with these keys of a body that swings so far.

    And their covariances after every `BLOCK` steps, [keys, blocks, 15, 15].
    """
    # As NumPy arrays: what JAX knows of the types of its own would be another program.
    state, errors, covariances = jax.tree.map(np.asarray, _begun(navigation, np.asarray(size), keys)), [], []
    for first in range(0, steps, BLOCK):
        state, block, covariance = _followed(navigation, np.asarray(size), keys, state, np.asarray(float(first)))
        errors.append(np.asarray(block))
        covariances.append(np.asarray(covariance))
    return np.concatenate(errors, axis=1), np.stack(covariances, axis=1)


@eqx.filter_jit
def _begun(navigation, size, keys):
    return jax.vmap(lambda key: navigation.init(navigation.realize(key), swinging(0.0, size)))(keys)


@eqx.filter_jit
def _followed(navigation, size, keys, states, first):
    def run(key, state):
        realization = navigation.realize(key)

        def advance(state, k):
            truth = swinging((first + k) * STEP, size)
            _, state = navigation.measure(realization, state, (first + k) * STEP, truth)
            return state, errors_of(state, truth)

        state, errors = jax.lax.scan(advance, state, jnp.arange(BLOCK, dtype=float))
        return state, errors, navigation.filter.covariance(state.filter)

    return jax.vmap(run)(keys, states)


def updated(own, state, elapsed, received, steps=1):
    """State of a filter after steps that are alike: one program for all numbers in it, wherever the state is from."""
    return _updated(own, jax.tree.map(np.asarray, state), elapsed, received, np.asarray(steps))


@jax.jit
def _updated(own, state, elapsed, received, steps):
    return jax.lax.fori_loop(0, steps, lambda k, state: own.update(state, elapsed, received), state)


@jax.jit
def started(own, position, velocity):
    """State of a filter that knows position and velocity."""
    return own.start(measurement_of_outputs(position, velocity))


@jax.jit
def read(own, state):
    """Signals, estimate and covariance of a filter."""
    return own.diagnostics(state), own.measurement(state), own.covariance(state)


LEVEL = np.zeros(6), np.zeros(6)


def errors_of(state, truth):
    """Truth minus estimate: attitude in world axes, gyro bias, velocity turned back, force bias, position."""
    own, offset = state.filter, state.sensors[0].offset
    w, x, y, z = own.attitude
    estimated = jnp.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
        ]
    )
    turned = rotation_from_euler(truth.position[3:]) @ estimated.T
    turn = jnp.array([turned[2, 1] - turned[1, 2], turned[0, 2] - turned[2, 0], turned[1, 0] - turned[0, 1]]) / 2
    velocity = turned.T @ truth.velocity[:3] - own.velocity
    parts = [turn, offset[2:5] - own.gyro_bias, velocity, offset[5:] - own.force_bias]
    return jnp.concatenate([*parts, truth.position[:3] - own.position])


def nothing(sensors):
    """Deliveries of sensors that are silent."""
    widths = {"IMU": 8, "DVL": 3, "PositionFix": 2}
    return tuple(
        Received(np.zeros(widths.get(type(one).__name__, 1)), np.asarray(False), np.zeros(())) for one in sensors
    )


def with_reading(received, index, reading, age=0.0):
    """The same with one reading."""
    one = Received(np.atleast_1d(np.asarray(reading, dtype=float)), np.asarray(True), np.asarray(age))
    return (*received[:index], one, *received[index + 1 :])


@pytest.mark.full
def test_the_covariance_spreads_as_the_matrix_exponential_says():
    """At rest and level the errors follow constant matrices; Van Loan (1978) gives the covariance exactly."""
    own, h, steps = kalman(ALL, gyro_drift=1e-3, force_drift=1e-2).filter, 0.01, 300
    state, quiet = started(own, *LEVEL), nothing(ALL)
    state = updated(own, state, np.asarray(h), quiet, steps)
    a = np.zeros((15, 15))
    g = 9.81
    a[ATTITUDE, GYRO_BIAS], a[VELOCITY, FORCE_BIAS], a[POSITION, VELOCITY] = -np.eye(3), -np.eye(3), np.eye(3)
    a[VELOCITY, ATTITUDE] = -np.array([[0, g, 0], [-g, 0, 0], [0, 0, 0]])  # -[f x], f = (0, 0, -g)
    of_rates, of_force = 0.01 * 2e-3**2, 0.01 * 0.02**2
    noise = np.diag(np.repeat([of_rates, 1e-6, of_force, 1e-4, 0.0], 3))
    t = steps * h
    both = expm(np.block([[-a, noise], [np.zeros((15, 15)), a.T]]) * t)
    over = both[15:, 15:].T
    expected = over @ np.diag(np.asarray(own.initial_deviations()) ** 2) @ over.T + over @ both[:15, 15:]
    found = np.asarray(read(own, state)[2])
    scale = np.sqrt(np.outer(np.diag(expected), np.diag(expected)))
    # Noise enters at the end of each step instead of throughout: off by about half a step in the time.
    assert np.abs((found - expected) / scale).max() < h / t
    np.testing.assert_array_equal(found, found.T)


@pytest.mark.full
def test_a_correction_is_that_of_the_textbook():
    """Entry by entry it gives what K = P H' (H P H' + R)^-1 gives for the whole reading."""
    own, quiet = kalman(ALL).filter, nothing(ALL)
    state = started(own, *outputs(0.7, numbers=np))
    state = updated(own, state, np.asarray(0.01), quiet, 50)
    before, p = state, np.asarray(read(own, state)[2])
    w = Rotation.from_euler("ZYX", angles_of(own, state)[::-1]).as_matrix()
    velocity = np.asarray(state.velocity)
    slopes = np.zeros((3, 15))
    slopes[:, VELOCITY] = w.T
    reading = w.T @ velocity + np.array([0.02, -0.01, 0.015])
    noise = 5e-3**2 + 1e-3**2 / 12
    spread = slopes @ p @ slopes.T + noise * np.eye(3)
    gain = p @ slopes.T @ np.linalg.inv(spread)
    correction, after = gain @ (reading - w.T @ velocity), (np.eye(15) - gain @ slopes) @ p
    is_as_recorded("kalman: half a second by an IMU", state._replace(monitor=None))
    # What one beam does not give changes nothing: as with a reading of the others alone.
    partial = updated(own, state, np.zeros(()), with_reading(quiet, 1, np.where([True, False, True], reading, np.nan)))
    others = slopes[[0, 2]]
    gain_of_others = p @ others.T @ np.linalg.inv(others @ p @ others.T + noise * np.eye(2))
    expected = (np.eye(15) - gain_of_others @ others) @ p
    np.testing.assert_allclose(read(own, partial)[2], expected, atol=1e-9 * np.abs(p).max())
    state = updated(own, state, np.zeros(()), with_reading(quiet, 1, reading))
    np.testing.assert_allclose(read(own, state)[2], after, atol=1e-9 * np.abs(p).max())
    innovation = np.linalg.solve(np.linalg.cholesky(spread), reading - w.T @ velocity)
    np.testing.assert_allclose(state.monitor.last[1], innovation, rtol=1e-6)
    turned = Rotation.from_rotvec(np.array(correction[ATTITUDE])).as_matrix()
    np.testing.assert_allclose(state.velocity, turned @ (velocity + correction[VELOCITY]), atol=1e-10)
    for name, part in (("position", POSITION), ("gyro_bias", GYRO_BIAS), ("force_bias", FORCE_BIAS)):
        moved = np.asarray(getattr(state, name)) - np.asarray(getattr(before, name))
        np.testing.assert_allclose(moved, correction[part], atol=1e-10)


def angles_of(own, state):
    """Euler angles of the estimated attitude."""
    return np.asarray(read(own, state)[1].position)[3:]


EXACT = dict.fromkeys(("position_deviation", "velocity_deviation", "tilt_deviation", "heading_deviation"), 1e-6)


@pytest.mark.full
@pytest.mark.parametrize(
    "sensors, size", [(ALL, 1.0), (ALL[:3], 0.0)], ids=["all sensors, swinging", "no compass or fixes, at rest"]
)
def test_errors_are_as_large_as_the_filter_says(sensors, size):
    """Normalised squared errors of 15 states over 40 runs: their mean is 15, within four standard deviations.

    At rest without a compass a filter with velocity errors in world axes believes in a heading that nothing measured.
    """
    keys = jax.random.split(jax.random.PRNGKey(4), 40)
    biases = {"gyro_bias_deviation": 5e-3, "force_bias_deviation": 0.05, "gyro_drift": 0, "force_drift": 0}
    found, covariances = followed(kalman(sensors, **EXACT, **biases), size, 3000, keys)
    for k in (500, 1500, 3000):
        errors, covariance = found[:, k - 1], covariances[:, k // BLOCK - 1]
        squares = np.einsum("ki,kij,kj->k", errors, np.linalg.inv(covariance), errors)
        assert abs(squares.mean() - 15) < 4 * np.sqrt(2 * 15 / len(keys)), (k, squares.mean())
    last = np.sqrt((np.asarray(found[:, -1]) ** 2).mean(0))
    observed = slice(GYRO_BIAS.start, GYRO_BIAS.stop if len(sensors) == len(ALL) else GYRO_BIAS.stop - 1)  # yaw is not
    assert (last[observed] < 0.2 * 5e-3).all() and (last[FORCE_BIAS] < 0.4 * 0.05).all()


@pytest.mark.full
def test_late_readings_count_as_much_as_their_age_says():
    """Fixes and velocities that come a second late, while the body swings: as consistent as fresh ones."""
    keys = jax.random.split(jax.random.PRNGKey(5), 40)
    late = [imu(), dvl(delay=1.0), depth(delay=0.5), compass(delay=0.7), position_fix(delay=1.0)]
    found, covariances = followed(kalman(late), 1.0, 2000, keys)
    position, of_position = np.asarray(found[:, -1, POSITION]), np.asarray(covariances[:, -1, POSITION, POSITION])
    squares = np.einsum("ki,kij,kj->k", position, np.linalg.inv(of_position), position)
    assert abs(squares.mean() - 3) < 4 * np.sqrt(2 * 3 / len(keys))
    assert np.abs(position).max() < 0.1  # the body moves 0.35 m in that second


@pytest.mark.full
def test_an_outlier_is_rejected_and_a_lasting_jump_is_believed_in_the_end():
    own = kalman(ALL).filter
    state = started(own, *LEVEL)
    fixed = updated(own, state, np.asarray(0.0), with_reading(nothing(ALL), 4, [100.0, 0.0]))
    assert int(fixed.rejected) == 1
    np.testing.assert_array_equal(fixed.position, state.position)
    np.testing.assert_array_equal(fixed.covariance, state.covariance)
    for count in range(1, 60):
        fixed = updated(own, fixed, np.asarray(0.0), with_reading(nothing(ALL), 4, [100.0, 0.0]))
        if int(fixed.rejected) == count:
            break
    assert count < 20 and float(np.asarray(fixed.position)[0]) > 50.0


@pytest.mark.full
@pytest.mark.parametrize("seed", range(4))
def test_nothing_that_a_sensor_says_makes_the_estimate_undefined(seed):
    """A sensor that has gone mad, for minutes: numbers of any size, of any age."""
    own, rng = kalman(ALL).filter, np.random.default_rng(seed)

    mad = rng.normal(size=(3000, 8)) * 10.0 ** rng.uniform(-3, 300, size=(3000, 8))
    state, quiet = started(own, *LEVEL), nothing(ALL)
    for reading, age in zip(mad, 10.0 ** rng.uniform(-3, 9, size=3000), strict=True):
        received = tuple(Received(reading[: len(one.reading)], np.asarray(True), age) for one in quiet)
        state = updated(own, state, np.asarray(0.01), received)
    assert all(np.isfinite(leaf).all() for leaf in jax.tree.leaves(state))
    assert int(state.rejected) > 0


def test_entries_that_are_none_are_left_out():
    """East is taken although north is NaN; a reading of nothing but NaN changes nothing."""
    own = kalman(ALL).filter
    state = started(own, *LEVEL)
    half = updated(own, state, np.asarray(0.0), with_reading(nothing(ALL), 4, [np.nan, 0.1]))
    north, east, _ = np.asarray(half.position)
    assert north == 0.0 and east > 0.05
    none = updated(own, state, np.asarray(0.0), with_reading(nothing(ALL), 4, [np.nan, np.inf]))
    for before, after in zip(jax.tree.leaves(state), jax.tree.leaves(none), strict=True):
        np.testing.assert_array_equal(before, after)


def test_readings_of_every_sensor_of_any_age():
    """Tilt, heading, depth and places that come late, while the body swings."""
    own, rng, times = kalman(ALL).filter, np.random.default_rng(3), 0.01 * np.arange(200)
    truth = jax.tree.map(np.asarray, jax.jit(jax.vmap(swinging))(times))
    gravity = truth.body.rotation[:, 2] * -9.81  # what accelerometers would read at rest
    readings = [
        np.concatenate([truth.position[:, 3:5], truth.body.nu[:, 3:], gravity], axis=1),
        truth.body.nu[:, :3],
        truth.position[:, 2:3],
        truth.position[:, 5:],
        truth.position[:, :2],
    ]
    state = started(own, *outputs(0.0, numbers=np))
    for k in range(1, 200):
        received = tuple(
            Received(rows[k] + 1e-3 * rng.normal(size=rows.shape[1]), np.asarray(k % every == 0), np.asarray(age))
            for rows, every, age in zip(readings, (1, 12, 5, 7, 50), (0.0, 0.08, 0.0, 0.02, 0.3), strict=True)
        )
        state = updated(own, state, np.asarray(0.01), received)
    assert np.abs(np.asarray(state.position) - truth.position[-1, :3]).max() < 0.1
    signals, estimate, _ = read(own, state)
    of_estimate = {name: signals[name] for name in ("navigation_deviation", "rejected_readings")}
    is_as_recorded("kalman: readings of every sensor", (state._replace(monitor=None), (of_estimate, estimate)))


def test_an_angle_may_have_turned_once():
    own = kalman(ALL).filter
    state = started(own, np.array([0, 0, 0, 0, 0, 3.13]), np.zeros(6))
    state = updated(own, state, np.asarray(0.0), with_reading(nothing(ALL), 3, -3.13))
    assert int(state.rejected) == 0
    assert abs(abs(angles_of(own, state)[2]) - np.pi) < 0.0117  # between both: half a turn


class RawIMU(IMU):
    """An IMU that does not fuse roll and pitch."""

    def reading(self, motion):
        return IMU.reading(self, motion).at[:2].set(jnp.nan)


@pytest.mark.full
def test_tilt_is_observed_without_a_reading_of_it():
    """Accelerometers tell it where velocities or positions are measured, as well as the filter says."""
    keys = jax.random.split(jax.random.PRNGKey(6), 40)
    sensors = [RawIMU(imu().sampling), *ALL[1:]]
    found, covariances = followed(kalman(sensors, tilt_deviation=0.05), 1.0, 2000, keys)
    tilt, of_tilt = np.asarray(found[:, -1, :2]), np.asarray(covariances[:, -1, :2, :2])
    squares = np.einsum("ki,kij,kj->k", tilt, np.linalg.inv(of_tilt), tilt)
    assert abs(squares.mean() - 2) < 4 * np.sqrt(2 * 2 / len(keys))
    assert np.abs(tilt).max() < 0.02


class Altimeter(AbstractSensor):
    """Height above a flat bottom, along the axis of the vehicle that looks down."""

    bottom: Float[Param, ""] = param("m", "depth of the bottom")

    def reading(self, motion):
        return ((self.bottom - motion.position[2:]) / motion.rotation[2, 2])[:1]


@pytest.mark.full
def test_a_sensor_of_a_user_needs_no_more_than_its_reading():
    sensors = [imu(), dvl(), compass(), position_fix(), Altimeter(Sampling(0.2, noise=0.02), bottom=20.0)]
    found, _ = followed(kalman(sensors), 1.0, 2000, jax.random.split(jax.random.PRNGKey(0), 4))
    assert np.sqrt((np.asarray(found[:, 500:, 14]) ** 2).mean()) < 0.02


variance_of = eqx.filter_jit(Kalman.variance)


def sensed(sensors):
    """What `advice` finds out of sensors."""
    own = kalman(ALL).filter
    names = {"IMU": (ATTITUDE, 2), "DVL": (VELOCITY, 3), "Depth": (POSITION, 1), "Compass": (ATTITUDE, 1)}
    found = []
    for one in sensors:
        part, count = names.get(type(one).__name__, (POSITION, 2))
        rows = {"Depth": [2], "Compass": [2]}.get(type(one).__name__, list(range(count)))
        slopes = np.zeros((count, 15))
        for i, row in enumerate(rows):
            slopes[i, part.start + row] = 1.0
        found.append(Sensed(slopes, np.asarray(variance_of(own, one, count)), float(one.sampling.period)))
    return found


UNSEEN = pytest.mark.parametrize(
    "sensors, unseen",
    [
        (ALL, []),
        ([imu(), dvl(), depth(), position_fix()], ["yaw"]),
        ([imu(), dvl(), depth(), compass()], ["north", "east"]),
        ([imu(), dvl(), compass(), position_fix()], ["down"]),
        ([imu()], ["north", "east", "down", "yaw"]),
    ],
)


@UNSEEN
def test_what_sensors_cannot_observe(sensors, unseen):
    assert unobservable(sensed(sensors)) == unseen


def test_deviations_grow_as_integrals_where_nothing_is_sensed():
    """Velocities and gyro biases are integrated once, white noise of the acceleration twice; a fix takes most of it."""
    initial, noise, duration = np.zeros(15), np.zeros(15), 4.0
    initial[POSITION], initial[VELOCITY] = [0.1, 0.2, 0.3], [0.05, 0.0, 0.02]
    initial[GYRO_BIAS] = [0.0, 0.0, 0.01]
    noise[VELOCITY] = [0.0, 0.03, 0.0]
    found = deviations([], initial, noise, duration)
    expected = {
        "north": np.hypot(0.1, 0.05 * duration),
        "east": np.sqrt(0.2**2 + 0.03 * duration**3 / 3),
        "down": np.hypot(0.3, 0.02 * duration),
        "yaw": 0.01 * duration,
    }
    for name, value in expected.items():
        assert found[name] == pytest.approx(value, rel=0.01), name
    slopes = np.zeros((1, 15))
    slopes[0, POSITION] = [1.0, 0.0, 0.0]
    # 100 readings of 0.1 m are one of 0.01 m; at rest without velocity errors they are averaged.
    fixed = deviations(
        [Sensed(slopes, np.array([0.01]), duration / 100)], initial * (np.arange(15) > 11), noise, duration
    )
    assert fixed["north"] == pytest.approx(1 / np.sqrt(1 / 0.1**2 + 100 / 0.01), rel=0.01)


@pytest.mark.parametrize(
    ("sensors", "unseen"),
    [
        ([imu(), dvl(), depth(), position_fix(), compass()], []),
        ([imu(), dvl(), depth(), position_fix()], ["yaw"]),
        pytest.param([imu(), dvl(), depth(), compass()], ["north", "east"], marks=pytest.mark.full),
        pytest.param([imu()], ["north", "east", "down", "yaw"], marks=pytest.mark.full),
    ],
)
def test_what_sensors_cannot_observe_is_said_in_words(sensors, unseen):
    said = kalman(sensors).advice(60.0)
    assert len(said) == bool(unseen)
    if unseen:
        assert f"the sensors cannot observe {', '.join(unseen)} of a vehicle at rest" in said[0]


@pytest.mark.full
def test_the_drift_that_is_predicted_is_that_of_the_filter():
    """Without fixes and compass: the deviations after a minute are those of a filter that ran for a minute."""
    sensors = [imu(), dvl(resolution=0.0, delay=0.0), depth(resolution=0.0)]
    navigation = kalman(sensors)
    own = navigation.filter
    of_rates, of_force = (np.asarray(one) for one in own.inertial_noise(sensors[0]))
    drifts = np.repeat([1e-5**2, 1e-4**2], 3)
    noise = np.concatenate([of_rates, drifts[:3], of_force, drifts[3:], np.zeros(3)])
    predicted = deviations(sensed(sensors), np.asarray(own.initial_deviations()), noise, 60.0)
    _, covariances = followed(navigation, 0.0, 6000, jax.random.split(jax.random.PRNGKey(0), 1))
    of_filter = np.sqrt(np.diag(np.asarray(covariances[0, -1])))
    for name, i in {"north": 12, "east": 13, "down": 14, "yaw": 2, "roll": 0}.items():
        np.testing.assert_allclose(predicted[name], of_filter[i], rtol=0.05, err_msg=name)


@pytest.mark.parametrize(
    "wrong",
    [
        {"gate": 0.0},
        {"noise_scale": -1.0},
        {"position_deviation": 0.0},
        {"longest_delay": -1.0},
        {"gyro_drift": np.nan},
    ],
)
def test_impossible_numbers(wrong):
    with pytest.raises(BadInput, match=next(iter(wrong))):
        kalman(ALL, **wrong)


def test_an_imu_is_needed():
    with pytest.raises(BadInput, match="IMU among them"):
        kalman([dvl(), depth()])


@pytest.mark.parametrize(
    "precision, duration",
    [
        pytest.param("float32", 30, marks=pytest.mark.full),
        pytest.param("float64", 2000, marks=pytest.mark.slow),
        pytest.param("float32", 2000, marks=pytest.mark.slow),
    ],
)
def test_errors_stay_as_large_as_the_filter_says(precision, duration):
    """BlueROV2 Heavy in a current, with biases: nothing drifts, in single precision either, and nothing is rejected."""
    sensors = [{"kind": "imu", "rate_bias": 2e-3, "force_bias": 0.05}, "dvl", "depth", "compass", "position_fix"]
    run = ut.simulate_scenario(
        {
            "plant": {"vehicle": "bluerov2_heavy", "thruster": {"kind": "t200", "supply": 16}},
            "controller": {"kind": "rcaf", "preset": "robust"},
            "reference": {"kind": "circle", "radius": 1.0, "period": 40},
            "disturbance": {"kind": "current", "velocity": [0.2, 0.1, 0]},
            "navigation": {"kind": "kalman", "sensors": sensors},
            "loop": {"dt": 0.01, "duration": duration, "record": 1.0},
            "precision": precision,
        }
    )
    late = slice(duration // 2, None)
    error = (run.dataset["measured_position"] - run.dataset["position"]).values[late]
    deviation = run.dataset["navigation_deviation"].values[late]
    assert (np.abs(error) < 4.5 * deviation).all() and (deviation[:, :2] < 0.02).all()
    assert int(run.dataset["rejected_readings"][-1]) == 0
