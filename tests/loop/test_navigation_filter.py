"""The navigation filter by itself: the bits of a simulation, readings as they come, states, and what others do wrong."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

import undertow as ut
from undertow.core import runtime
from undertow.core.errors import BadInput
from undertow.core.measurement import measurement_of_outputs
from undertow.outside.autopilot.navigation_filter import NavigationFilter
from undertow.scenario.build import build
from undertow.scenario.reading import from_data
from undertow.simulation.loop.stepped import compile_step, copy_into

pytestmark = pytest.mark.full

SCENARIO = {
    "plant": {"vehicle": "bluerov2_heavy", "thruster": {"kind": "t200", "supply": 16}},
    "controller": {"kind": "pid", "frequency": 2.0},
    "reference": {"kind": "setpoint", "position": [0, 0, 0, 0, 0, 0]},
    "navigation": {
        "kind": "kalman",
        "sensors": ["imu", {"kind": "dvl", "dropout": 0.2}, "depth", "compass", "position_fix"],
    },
    "loop": {"duration": 1.0, "dt": 0.01},
}
PERIOD = 0.01


@pytest.fixture(scope="module", params=["kalman", "observer"])
def made(request):
    """A scenario, and its filter by itself."""
    scenario = SCENARIO | {"navigation": SCENARIO["navigation"] | {"kind": request.param}}
    return scenario, ut.NavigationFilter(scenario)


@pytest.fixture(scope="module")
def kalman_alone():
    return ut.NavigationFilter(SCENARIO)


def swinging(t):
    amplitude, frequency = jnp.array([1.0, 0.7, 0.4, 0.3, 0.2, 0.5]), jnp.array([0.3, 0.5, 0.4, 0.7, 0.6, 0.2])
    return measurement_of_outputs(amplitude * jnp.sin(frequency * t), amplitude * frequency * jnp.cos(frequency * t))


def simulated(scenario, steps):
    """What sensors deliver and what the filter makes of it in a simulation, step by step: (received, pose, velocity)."""
    with runtime.on_processor(), runtime.in_precision("float64"):
        navigation = build(from_data(scenario)).closed_loop.navigation
        key = jax.random.PRNGKey(3)
        realization = navigation.realize(key)
        begin = navigation.init(realization, swinging(jnp.zeros(())))

        def advance(part, state, t):
            truth = swinging(t)
            received, _, _ = part.sample(realization, state, t, truth)
            y, state = part.measure(realization, state, t, truth)
            return state, (received, y.position, y.body.nu)

        step = compile_step(advance, navigation, jax.tree.map(np.asarray, begin), np.zeros(()))
        assert step.backend == "simd"
        for k in range(steps):
            copy_into(step.inputs, np.asarray(k * PERIOD))
            step()
            yield jax.tree.map(lambda leaf: leaf.copy(), step.outputs)


def readings_of(alone, received):
    return {name: one.reading for name, one in zip(alone.sensors, received, strict=True) if one.fresh}


def start_of(alone, readings=None):
    truth = swinging(jnp.zeros(()))
    return alone.start(truth.position[:3], truth.body.nu, truth.body.attitude, readings)


def test_every_bit_is_that_of_a_simulation(made):
    scenario, alone = made
    assert alone.backend == "simd"
    for k, (received, pose, nu) in enumerate(simulated(scenario, 150)):
        readings = readings_of(alone, received)
        found = start_of(alone, readings) if k == 0 else alone.step(readings)
        np.testing.assert_array_equal(found.position, pose[:3])
        np.testing.assert_array_equal(found.velocity, nu)
    assert alone.counts == {"steps": 149, "late": 0, "missed": 0, "repeated": 0}


def test_an_autopilot_and_a_filter_fly_the_vehicle_of_a_simulation():
    """Readings go in, volts come out: the estimate stays within centimetres of the truth of a simple simulator."""
    scenario = SCENARIO | {"controller": {"kind": "rcaf", "preset": "robust"}}
    alone, autopilot = NavigationFilter(scenario), ut.Autopilot(scenario, attitude="quaternion", output="wrench")
    rng, inertia, damping = np.random.default_rng(0), np.array([17, 24, 26]), np.array([13, 20, 30])
    position, velocity = np.zeros(3), np.zeros(3)
    found = alone.start(position, np.zeros(6), [0.0, 0.0, 0.0])
    goal = [1, 0.5, 0.3, 0, 0, 0]
    wrench = autopilot.start(found.position, found.velocity, found.attitude, target=goal)
    for k in range(1, 3000):
        acceleration = (wrench[:3] - damping * velocity) / inertia
        velocity = velocity + PERIOD * acceleration
        position = position + PERIOD * velocity
        noise = rng.normal(size=8) * np.repeat([5e-3, 2e-3, 0.02], [2, 3, 3])
        readings = {"imu": np.concatenate([np.zeros(5), acceleration - [0, 0, 9.81]]) + noise}
        if k % 12 == 0:
            readings["dvl"] = velocity + 5e-3 * rng.normal(size=3)
        if k % 5 == 0:
            readings |= {"depth": position[2:] + 2e-3 * rng.normal(size=1), "compass": 5e-3 * rng.normal(size=1)}
        if k % 100 == 0:
            readings["position_fix"] = position[:2] + 0.05 * rng.normal(size=2)
        found = alone.step(readings, ages={"dvl": 0.0, "position_fix": 0.0})
        wrench = autopilot.step(found.position, found.velocity, found.attitude, target=goal)
    deviation = alone.signals()["navigation_deviation"]
    assert (np.abs(found.position - position) < 4 * deviation[:3]).all() and (deviation[:3] < 0.05).all()
    assert np.abs(position - goal[:3]).max() < 0.06


def test_a_state_goes_on_with_the_same_bits(kalman_alone):
    alone = kalman_alone
    start_of(alone)
    alone.step({"depth": [0.01]})
    state = alone.save()
    first = alone.step({"dvl": [0.1, 0.0, 0.0]}, ages={"dvl": 0.03})
    alone.step({})
    alone.restore(state)
    for one, other in zip(first, alone.step({"dvl": [0.1, 0.0, 0.0]}, ages={"dvl": 0.03}), strict=True):
        np.testing.assert_array_equal(one, other)
    with pytest.raises(BadInput, match="checksum"):
        alone.restore(state[:-9] + bytes([state[-9] ^ 1]) + state[-8:])


def test_readings_that_are_none_and_outliers_change_nothing(kalman_alone):
    alone = kalman_alone
    start_of(alone)
    state = alone.save()
    expected = alone.step({})
    for readings in ({"position_fix": [np.nan, np.nan]}, {"position_fix": [500.0, 0.0]}, {"imu": np.full(8, np.inf)}):
        alone.restore(state)
        for one, other in zip(expected, alone.step(readings), strict=True):
            np.testing.assert_array_equal(one, other)


def test_late_steps_follow_the_rule_of_the_autopilot(kalman_alone):
    alone = kalman_alone
    start_of(alone)
    moved = alone.step({}, dt=0.04).position - alone.step({}, dt=-1.0).position
    np.testing.assert_array_equal(moved, 0.0)
    alone.step({}, dt=1.0)
    assert alone.counts == {"steps": 3, "late": 1, "missed": 1, "repeated": 1}


@pytest.mark.parametrize(
    "call, said",
    [
        (lambda alone: alone.step({"dvll": [0, 0, 0]}), "dvl"),
        (lambda alone: alone.step({"dvl": [0, 0]}), r"`readings\['dvl'\]` must have shape \(3,\)"),
        (lambda alone: alone.step({"dvl": "fast"}), "must be numbers"),
        (lambda alone: alone.step({}, ages={"dvl": -1.0}), r"`ages\['dvl'\]`"),
        (lambda alone: alone.step({}, ages=0.08), "`ages` must be a mapping"),
        (lambda alone: alone.step({}, ages={"gps": 1.0}), "`ages` must be of sensors of the scenario"),
        (lambda alone: alone.step({}, dt="10"), "`dt` must be a number"),
        (lambda alone: alone.step({}, dt=np.array([0.01])), r"`dt` must have shape \(\)"),
        (lambda alone: alone.start([0, 0, np.nan], np.zeros(6), np.zeros(3)), "position"),
        (lambda alone: alone.start(np.zeros(3), np.zeros(6), np.zeros(4)), "quaternion of some length"),
    ],
)
def test_what_others_do_wrong(kalman_alone, call, said):
    start_of(kalman_alone)
    before = kalman_alone.save()
    with pytest.raises(BadInput, match=said):
        call(kalman_alone)
    assert kalman_alone.save() == before


def test_a_filter_has_to_be_there():
    with pytest.raises(BadInput, match="`kalman` or `observer`"):
        ut.NavigationFilter(SCENARIO | {"navigation": "perfect"})
