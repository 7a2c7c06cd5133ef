"""A supervised autopilot: the bits of a simulation, its requests, its limits, and damage to its memory."""

import numpy as np
import pytest

import undertow as ut
from undertow.control.supervision.supervised_controller import state_in
from undertow.scenario.reading import dump

pytestmark = pytest.mark.full

SCENARIO = {
    "plant": {"vehicle": "bluerov2_heavy", "thruster": {"kind": "t200", "supply": 16}},
    "controller": "pid",
    "supervisor": True,
    "navigation": {"kind": "white_noise", "position": 1e-4, "velocity": 1e-4},
    "reference": {"kind": "setpoint", "position": [0.5, 0, 0.5, 0, 0, 0.3]},
    "loop": {"dt": 0.02, "duration": 1.0, "record": 0.02},
}
REST = np.zeros(3), np.zeros(6), np.zeros(3)


@pytest.fixture(scope="module")
def autopilot():
    return ut.Autopilot(SCENARIO, attitude="euler", velocity="rates")


def test_it_has_the_bits_of_a_simulation(autopilot):
    run = ut.simulate_scenario(SCENARIO).dataset
    position, velocity = run["measured_position"].values, run["measured_velocity"].values
    taken = [autopilot.start(position[0, :3], velocity[0], position[0, 3:])]
    for k in range(1, len(position)):
        taken.append(autopilot.step(position[k, :3], velocity[k], position[k, 3:]))
    assert autopilot.backend == "simd" and autopilot.state == ("ACTIVE", "")
    np.testing.assert_array_equal(taken, run["commanded_input"].values)


def test_requests_are_obeyed_without_a_jump(autopilot):
    before, most = autopilot.start(*REST), 32.0 * 0.02
    for request, state in (
        ("hold", "READY"),
        ("run", "ACTIVE"),
        ("fallback", "ACTIVE"),
        ("law", "ACTIVE"),
        ("stop", "STOPPED"),
    ):
        autopilot.request(request)
        autopilot.step(*REST)
        output = autopilot.step(*REST)
        assert autopilot.state[0] == state
    assert np.abs(output - before).max() <= 16 and most > 0
    with pytest.raises(ut.BadInput, match="request"):
        autopilot.request("fly")


def test_it_begins_at_the_input_that_was_applied(autopilot):
    """The difference from the law's own output ends with the slew rate: a range per second."""
    most = 32.0 * 0.02
    first = autopilot.start(*REST, applied=np.full(8, 1e6))
    assert (first <= 16).all() and (first >= 16 - most * (1 + 1e-12)).all()
    sizes = []
    for _ in range(51):
        sizes.append(np.abs(state_in(autopilot._go_on.state).beyond).max())
        autopilot.step(*REST)
    np.testing.assert_allclose(-np.diff(sizes[:10]), most, rtol=1e-9)
    assert sizes[-1] == 0


@pytest.mark.parametrize("dt", [0.0, -1.0, np.nan, np.inf, 1e-310, 1e9])
def test_any_time_and_reading_gives_an_input_within_limits(autopilot, dt):
    autopilot.start(*REST)
    for reading in (np.nan, np.inf, 1e300, -1e20, 0.0):
        output = autopilot.step(np.full(3, reading), np.full(6, reading), np.full(3, reading), dt=dt)
        assert (np.abs(output) <= 16).all()


@pytest.mark.parametrize("speed", [5.0, 14.0])
def test_no_reading_damages_the_memory_or_ends_a_stop(autopilot, speed):
    """A motion that the model's drag would stop within a step, for 5 s; and numbers whose squares are infinite."""
    autopilot.start(*REST)
    autopilot.step(*REST)
    autopilot.request("stop")
    for _ in range(100):
        autopilot.step(np.zeros(3), np.array([speed, 0.7 * speed, 0, 0, 0, 0]), np.zeros(3))
    for size in (1e155, 1e300):
        autopilot.step(np.full(3, size), np.zeros(6), np.zeros(3))
        autopilot.step(np.zeros(3), np.full(6, size), np.zeros(3))
    outputs = [autopilot.step(*REST) for _ in range(40)]
    assert autopilot.state == ("STOPPED", "operator") and (np.array(outputs) == 0).all()
    assert "memory_damaged" not in {one.reason for one in autopilot.transitions()}


def test_a_report_that_stands_still_does_not_set_thrusters_against_each_other(tmp_path):
    """Of eight thrusters two combinations move nothing, so that no motion contradicts the report."""
    path = tmp_path / "vehicle.yaml"
    path.write_text(dump(SCENARIO | {"controller": "robust"}))
    vehicle, autopilot = (kind(path, attitude="quaternion") for kind in (ut.Vehicle, ut.Autopilot))
    report = np.array([-8.0, -6.0, -8.0, -8.0, -8.0, -6.0, 2.0, -2.5])
    motion = vehicle.output.truth
    outputs = [autopilot.start(motion.position, motion.velocity, motion.attitude)]
    for _ in range(150):
        motion = vehicle.step(outputs[-1], 0.02).truth
        outputs.append(autopilot.step(motion.position, motion.velocity, motion.attitude, applied=report))
    assert autopilot.state == ("DEGRADED", "applied_contradicted")
    assert np.abs(outputs[100:]).max() < 5.0


def test_a_damaged_memory_is_mended(autopilot):
    autopilot.start(*REST)
    autopilot.step(*REST)
    state_in(autopilot._go_on.state).output[...] = np.nan
    outputs = [autopilot.step(*REST) for _ in range(5)]
    assert np.isfinite(outputs).all() and autopilot.state == ("ACTIVE", "")
    assert "memory_damaged" in {one.reason for one in autopilot.transitions()}
