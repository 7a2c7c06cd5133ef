"""Samples of an IMU that no vehicle can move like, and a filter that most of its sensors contradict."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from undertow.control.navigation.disagreement import distrusted
from undertow.control.navigation.inertial_gate import gate_for
from undertow.control.navigation.kalman import kalman
from undertow.control.navigation.observer import observer
from undertow.core.errors import BadInput
from undertow.core.measurement import measurement_of_outputs
from undertow.physics.sensors import compass, depth, dvl, imu, position_fix
from undertow.physics.sensors.received import Received
from undertow.scenario.build import build
from undertow.scenario.reading import from_data

STEP = 0.01  # s
AT_REST = np.array([0, 0, 0, 0, 0, 0, 0, -9.81])
QUIET = {"resolution": 0.0, "delay": 0.0}
SENSORS = (imu(), dvl(0.12, **QUIET), depth(0.1, resolution=0.0), compass(0.1), position_fix(1.0, delay=0.0))
EVERY, WIDTHS = (1, 12, 10, 10, 100), (8, 3, 1, 1, 2)
FILTERS = {"kalman": kalman(SENSORS).filter, "observer": observer(SENSORS).filter}


@jax.jit
def _followed(own, state, offsets):
    """Speed (m/s), angle of the attitude (rad) and signals of a filter of a vehicle at rest, with errors of the IMU."""

    def advance(state, given):
        k, offset = given
        at_rest = (AT_REST, *(np.zeros(width) for width in WIDTHS[1:]))
        received = tuple(
            Received(reading + (offset if i == 0 else 0.0), k % every == 0, jnp.zeros(()))
            for i, (reading, every) in enumerate(zip(at_rest, EVERY, strict=True))
        )
        state = own.update(state, jnp.asarray(STEP), received)
        y = own.measurement(state)
        speed, angle = jnp.linalg.norm(y.body.nu[:3]), 2 * jnp.arcsin(jnp.linalg.norm(y.body.attitude[1:]))
        return state, (speed, angle, y.body.nu, own.diagnostics(state))

    return jax.lax.scan(advance, state, (jnp.arange(1, len(offsets) + 1), offsets))


@jax.jit
def _started(own):
    return own.start(measurement_of_outputs(jnp.zeros(6), jnp.zeros(6)))


@jax.jit
def _received(gate, memory, sample, fresh):
    return gate.received(memory, jnp.asarray(STEP), sample, fresh, jnp.full(6, 1e-3))


def followed(kind, offsets, change=lambda state: state):
    """The same from a start at rest; `change` alters the state there."""
    own = FILTERS[kind]
    state = change(_started(own))
    return jax.tree.map(np.asarray, _followed(own, state, jnp.asarray(offsets)))[1]


def glitch(entry, size, samples, steps=1000, onset=500):
    offsets = np.zeros((steps, 8))
    offsets[onset : onset + samples, entry] = size
    return offsets


@pytest.mark.full
@pytest.mark.parametrize("kind", FILTERS)
@pytest.mark.parametrize(("entry", "size"), [(2, 34.9), (3, -34.9), (4, 34.9), (5, 159.0), (7, -149.0)])
def test_samples_at_full_scale_move_nothing(kind, entry, size):
    """Two of them: before, the velocity was wrong by up to 10 m/s, and 46 s passed until it was right within 0.2 m/s."""
    speed, angle, nu, signals = followed(kind, glitch(entry, size, 2))
    assert speed.max() < 0.05 and angle.max() < 0.02 and np.abs(nu[:, 3:]).max() < 0.05
    assert signals["rejected_inertial"][-1] == 2
    if kind == "kalman":
        assert signals["rejected_readings"][-1] == 0


@pytest.mark.full
def test_a_lasting_error_of_the_gyroscopes_leaves_the_estimate_to_the_other_sensors():
    """Half a second of 9 rad/s, which is believed after a quarter: the attitude follows the inclination."""
    speed, angle, _, signals = followed("kalman", glitch(2, 9.0, 50))
    assert speed.max() < 0.5 and angle.max() < 0.3 and speed[-300:].max() < 0.01 and angle[-300:].max() < 0.01
    assert signals["rejected_inertial"][-1] < 50


GATE = gate_for([5.0, 5.0, 5.0, 20.0, 20.0, 20.0], 2.0, 10.0)


def passed(samples, memory=None, fresh=None):
    """What a gate believes of samples of the first gyroscope, and the distrust in it."""
    memory = GATE.start(jnp.zeros(6)) if memory is None else memory
    found = []
    for k, sample in enumerate(samples):
        new = np.asarray(True if fresh is None else fresh[k])
        memory = _received(GATE, memory, sample * np.eye(6)[0], new)
        found.append((float(memory.values[0]), float(memory.distrust[0])))
    return np.array(found), memory


def test_one_sample_is_replaced_by_the_last_one_and_leaves_no_doubt():
    found, memory = passed([0.1, 0.2, 9.0, 0.3, 0.4])
    np.testing.assert_allclose(found[:, 0], [0.1, 0.2, 0.2, 0.3, 0.4])
    assert int(memory.rejected) == 1 and found[-1, 1] < 0.1


def test_the_largest_acceleration_passes_and_a_larger_one_does_not():
    """40 rad/s^2 are twice those of the thrusters: 0.4 rad/s in a step, and eight deviations of noise."""
    fast, _ = passed(np.concatenate([[0.0], 0.4 * np.arange(1, 20)]))
    np.testing.assert_allclose(fast[:, 0], np.concatenate([[0.0], 0.4 * np.arange(1, 20)]))
    assert (fast[:, 1] == 0).all()
    faster, memory = passed([0.0, 0.42])
    assert faster[-1, 0] == 0.0 and int(memory.rejected) == 1


def test_a_lasting_change_is_believed_after_a_quarter_of_a_second_with_a_doubt_that_fades():
    """A change that would take 0.5 s at the largest acceleration of 20 rad/s^2 is believed earlier."""
    slow = gate_for([5.0, 5.0, 5.0, 10.0, 10.0, 10.0], 2.0, 10.0)
    memory, values, distrusts = slow.start(jnp.zeros(6)), [], []
    for k in range(400):
        sample = np.full(6, 9.9) * (np.arange(6) == 0) * (k > 0)
        memory = _received(slow, memory, sample, np.asarray(True))
        values.append(float(memory.values[0]))
        distrusts.append(float(memory.distrust[0]))
    assert values[24] == 0.0 and values[25] == pytest.approx(9.9)
    assert distrusts[25] == pytest.approx(9.9) and distrusts[225] == pytest.approx(9.9 / np.e, rel=0.01)


def test_a_gate_is_open_after_silence_and_shut_to_what_no_vehicle_does():
    after_silence, memory = passed([0.0, 0.0, 0.0, 1.5], fresh=[True, False, False, True])
    assert after_silence[-1, 0] == 0.0 and int(memory.rejected) == 1  # 1.2 rad/s are possible in 0.03 s
    possible, _ = passed([0.0, 0.0, 0.0, 1.1], fresh=[True, False, False, True])
    assert possible[-1, 0] == pytest.approx(1.1) and possible[-1, 1] == 0.0
    never, _ = passed(np.full(300, 10.5))
    assert (never[:, 0] == 0.0).all()


def test_no_rejection_adds_no_uncertainty():
    _, memory = passed(0.3 * np.sin(0.1 * np.arange(50)))
    np.testing.assert_array_equal(GATE.uncertainty(memory), np.zeros(6))
    _, held = passed([0.0, 9.0])
    np.testing.assert_allclose(GATE.uncertainty(held)[0], (40.0 * STEP / 3) ** 2 * STEP)


@pytest.mark.parametrize(
    ("wrong", "named"),
    [
        ({"authority": [1.0] * 5}, "authority"),
        ({"authority": [-1.0] * 6}, "authority"),
        ({"inertial_factor": 0.0}, "inertial_factor"),
        ({"largest_rate": -1.0}, "largest_rate"),
    ],
)
@pytest.mark.parametrize("made", [kalman, observer])
def test_impossible_gates(made, wrong, named):
    with pytest.raises(BadInput, match=named):
        made([imu()], **wrong)


@pytest.mark.full
def test_a_scenario_gives_the_gate_what_the_thrusters_of_the_nominal_model_can_do():
    """The sum over the thrusters of the acceleration of each at its limit: 4 N/V at 10 V."""
    scenario = {
        "plant": {"vehicle": "bluerov2", "thruster": {"kind": "first_order", "thrust_per_volt": 4.0, "supply": 10.0}},
        "controller": {"kind": "pid", "frequency": 1.0},
        "reference": {"kind": "setpoint", "position": [0, 0, 0, 0, 0, 0]},
        "navigation": {"kind": "observer", "sensors": ["imu", "dvl"]},
        "loop": {"duration": 1, "dt": 0.01},
    }
    built = build(from_data(scenario))
    authority = np.array(built.resolved["navigation"]["authority"])
    model = built.closed_loop.controller.model
    gain = np.abs(model.dynamics.gain(measurement_of_outputs(jnp.zeros(6), jnp.zeros(6))))
    np.testing.assert_allclose(authority, 40.0 * gain.sum(1), rtol=5e-3)
    gate = built.closed_loop.navigation.filter.inertial
    np.testing.assert_allclose(gate.slew[:3], np.maximum(2 * authority[3:], 20.0))


def displaced(state):
    """A filter that is sure of an attitude, a velocity and a place that are wrong."""
    half = 0.35
    roll = jnp.array([np.cos(half), np.sin(half), 0.0, 0.0])
    return state._replace(
        attitude=roll,
        velocity=jnp.array([3.0, -2.0, 1.0]),
        position=jnp.array([4.0, 0.0, 5.0]),
        covariance=state.covariance / 100,
    )


@pytest.mark.full
def test_most_sensors_are_right_against_the_filter():
    """Its covariance grows until they are taken: it is right again within a second, and says that it was wrong."""
    speed, angle, _, signals = followed("kalman", np.zeros((500, 8)), displaced)
    assert speed[0] > 3.5 and speed[150:].max() < 0.05 and angle[150:].max() < 0.02
    assert 1 <= signals["reopened_gates"][-1] <= 3
    assert signals["rejected_readings"][-1] < 40


@pytest.mark.full
def test_one_sensor_alone_opens_no_gate_of_another():
    """Half a second of an inclination that is wrong by 0.5 rad, without a word of the gyroscopes."""
    speed, angle, _, signals = followed("kalman", glitch(0, 0.5, 50))
    assert signals["reopened_gates"][-1] == 0 and speed.max() < 0.05 and angle.max() < 0.02
    assert signals["rejected_readings"][-1] == 50


def test_what_a_reading_contradicts_falls_to_what_it_depends_on():
    """Not to what is merely correlated with it; a reading of a sum distrusts each term by its variance."""
    covariance = jnp.array([[4.0, 1.9, 0.0], [1.9, 1.0, 0.0], [0.0, 0.0, 2.0]])
    np.testing.assert_allclose(distrusted(covariance, jnp.array([[1.0, 0.0, 0.0]]), jnp.array([3.0])), [9.0, 0.0, 0.0])
    both = distrusted(covariance, jnp.array([[1.0, 0.0, 1.0]]), jnp.array([3.0]))
    np.testing.assert_allclose(both, [9 * (4 / 6) ** 2, 0.0, 9 * (2 / 6) ** 2])
