"""`ut.Vehicle`: the bits of a simulation, formats, seeds, times, and what it refuses."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

import undertow as ut
from undertow.core.errors import BadInput
from undertow.core.measurement import measurement_of_pose
from undertow.core.status import Status
from undertow.outside.autopilot.measured_motion import ATTITUDES, VELOCITIES, Format, motion_in

PENDULUM = {
    "plant": "inverted_pendulum",
    "controller": {"kind": "pid", "frequency": 3.0},
    "reference": {"kind": "sine", "amplitude": 0.1, "frequency": 1},
    "navigation": {"kind": "white_noise", "position": 0.001, "velocity": 0.01},
    "disturbance": {"kind": "sinusoid", "amplitude": 1.0, "frequency": 2.0},
    "faults": [{"target": "input", "number": 1, "mode": "scale", "severity": 0.5, "onset": 0.2}],
    "initial": {"position": [0.05]},
    "loop": {"duration": 0.5, "dt": 0.005, "record": 0.005},
    "seed": 7,
}


@pytest.fixture(scope="module")
def pendulum():
    return ut.Vehicle(PENDULUM)


def outputs_of(vehicle, commands):
    return [vehicle.restart(), *(vehicle.step(command) for command in commands)]


@pytest.mark.full
def test_every_bit_is_that_of_a_simulation(pendulum):
    """With noise, a disturbance and a fault; the command is the simulation's."""
    record = ut.simulate_scenario(PENDULUM).dataset
    seen = outputs_of(pendulum, record["commanded_input"].values[:-1])
    for name, series in (("position", "measured_position"), ("velocity", "measured_velocity")):
        np.testing.assert_array_equal([getattr(one, name) for one in seen], record[series].values)
    np.testing.assert_array_equal([one.truth.position for one in seen], record["position"].values)
    np.testing.assert_array_equal([one.applied for one in seen[1:]], record["input"].values[:-1])
    assert seen[0].applied is None and pendulum.time == pytest.approx(0.5, abs=1e-12)
    assert (record["acting_input"] != record["input"]).any(), "the fault acts"


@pytest.mark.full
def test_an_autopilot_and_a_vehicle_are_a_simulation(pendulum):
    record = ut.simulate_scenario(PENDULUM).dataset
    autopilot = ut.Autopilot(PENDULUM)
    commands = [autopilot.start(**pendulum.restart().measurement())]
    for _ in range(100):
        commands.append(autopilot.step(**pendulum.step(commands[-1]).measurement()))
    np.testing.assert_allclose(commands, record["commanded_input"].values, rtol=1e-9, atol=1e-9)


@pytest.mark.full
def test_seeds(pendulum):
    """Noise of a seed is that of a scenario with this seed; the same again without one."""
    commands = np.zeros((5, 1))
    other = outputs_of(ut.Vehicle(PENDULUM, seed=8), commands)
    usual = outputs_of(pendulum, commands)
    pendulum.restart(8)
    found = outputs_of(pendulum, commands)
    pendulum.restart(7)
    again = outputs_of(pendulum, commands)
    positions = lambda seen: np.array([one.position for one in seen])
    np.testing.assert_array_equal(positions(found), positions(other))
    np.testing.assert_array_equal(positions(again), positions(usual))
    assert (positions(found)[1:] != positions(usual)[1:]).all()


@pytest.mark.full
def test_a_time_is_divided_into_sampling_times_and_a_rest(pendulum):
    pendulum.restart()
    found = pendulum.step([1.5], 0.0175).truth
    pendulum.restart()
    for dt in (None, 0.005, None, 0.0025):
        expected = pendulum.step([1.5], dt).truth
    np.testing.assert_array_equal(found.position, expected.position)
    assert pendulum.time == pytest.approx(0.0175, abs=1e-15)


@pytest.mark.full
@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (([1.0, 2.0],), r"`command` must have shape \(1,\), but is of shape \(2,\)"),
        (([np.nan],), r"`command\[0\]` must be a finite number"),
        ((["1"],), "`command` must be numbers"),
        (([1.0], 0.0), "`dt` must be positive"),
        (([1.0], np.inf), "`dt` must be positive"),
        (([1.0], np.nan), "`dt` must be positive"),
    ],
)
def test_what_a_step_refuses(pendulum, arguments, message):
    before = pendulum.time
    with pytest.raises(BadInput, match=message):
        pendulum.step(*arguments)
    assert pendulum.time == before


@pytest.mark.full
@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"command": "newtons"}, "`command` must be one of input, pulses"),
        ({"command": "pulses"}, "`plant` must be a vehicle with thrusters"),
        ({"attitude": "angles"}, "`attitude` must be one of"),
        ({"sampling_time": -1.0}, "`sampling_time` must be positive"),
    ],
)
def test_what_a_vehicle_cannot_be_made_of(options, message):
    with pytest.raises(BadInput, match=message):
        ut.Vehicle(PENDULUM, **options)


@pytest.mark.full
def test_a_state_that_is_not_finite_keeps_the_last_valid_one(pendulum):
    before = pendulum.restart().truth
    state = jax.tree.leaves(pendulum.state)
    state[1][...] = 1e300
    seen = pendulum.step([0.1])
    assert not pendulum.going_on and seen.status is not Status.OK
    np.testing.assert_array_equal(seen.truth.position, before.position)


@pytest.mark.parametrize("attitude", ATTITUDES)
@pytest.mark.parametrize("velocity", VELOCITIES)
def test_a_motion_in_a_format_is_turned_back(attitude, velocity):
    if (attitude == "both") != (velocity == "both"):
        return
    form = Format(attitude, velocity)
    quaternion = np.array([0.8, 0.1, -0.2, 0.3])
    quaternion /= np.linalg.norm(quaternion)
    numbers = map(jnp.asarray, (np.array([1.0, 2, 3]), quaternion, np.array([0.5, -0.2, 0.1, 0.3, 0.2, -0.1])))
    truth = measurement_of_pose(*numbers, None)
    motion = motion_in(form, truth)
    assert [len(part) for part in motion] == [len(part) for part in form.columns()]
    back = form.measurement(motion, None)
    np.testing.assert_allclose(back.position, truth.position, atol=1e-14)
    np.testing.assert_allclose(back.velocity, truth.velocity, atol=1e-14)
    np.testing.assert_allclose(back.body.nu, truth.body.nu, atol=1e-14)
