"""The simulated vehicle as a node: its paces, and commands that are wrong, missing or late."""

import time

import numpy as np
import pytest
from peer import Running, Said, until

import undertow as ut
from undertow.core.errors import BadInput
from undertow.core.status import Status
from undertow.outside.autopilot.vehicle import Vehicle
from undertow.outside.ros2 import messages as ros
from undertow.outside.ros2.checked_scenario import check_vehicle
from undertow.outside.ros2.from_messages import Frames, motion_of, nanoseconds_of
from undertow.outside.ros2.link import Link
from undertow.outside.ros2.node import Reporter
from undertow.outside.ros2.to_messages import thrusters_of
from undertow.outside.ros2.vehicle_node import VehicleNode, VehicleSettings
from undertow.scenario.build import build

pytestmark = pytest.mark.interop

SCENARIO = {
    "plant": {"vehicle": "odin", "thruster": {"kind": "paper_table3", "fidelity": "shaft", "supply": 24}},
    "controller": {"kind": "pid", "frequency": 1.0},
    "reference": {"kind": "setpoint", "position": [0, 0, 0, 0, 0, 0]},
    "disturbance": {"kind": "current", "velocity": [0.3, 0.2, 0]},
    "loop": {"duration": 0.5, "dt": 0.05, "record": 0.05},
}
VOLTS = np.linspace(-20, 20, 8)


@pytest.fixture(scope="module")
def vehicle():
    return Vehicle(build(SCENARIO), attitude="quaternion")


class Controller:
    """The other side: it sees odometry and sends what it likes."""

    def __init__(self, domain):
        self.link = Link(domain, True)
        self.odometry = self.link.subscriber("/odom", ros.Odometry)
        self.imu = self.link.subscriber("/imu", ros.Imu)
        self.clock = self.link.subscriber("/clock", ros.Clock)
        self.thrusters = self.link.publisher("/thrusters", ros.Float64MultiArray)


@pytest.fixture
def setup(vehicle, domain):
    """A function of settings that gives node, controller and what the node says."""
    links = []

    def made(**settings):
        said, link, other = Said(), Link(domain, True), Controller(domain)
        links.extend((link, other.link))
        node = VehicleNode(vehicle, link, VehicleSettings(**settings), Reporter(said))
        until(lambda: other.odometry.publishers() and other.imu.publishers() and other.thrusters.subscribers())
        return node, other, said

    yield made
    for link in links:
        link.close()


def positions(messages):
    return np.array([motion_of(one, Frames(), "/odom").position for one in messages])


def test_lock_step_waits_for_each_command(setup, vehicle):
    node, other, _ = setup(pace="lock-step")
    running, seen = Running(node.run), []
    for _ in range(11):
        seen += until(other.odometry.take)
        assert len(seen) == len(positions(seen))
        other.thrusters.publish(thrusters_of(VOLTS, "thrusters [V]"))
    running.join(10)
    assert running.result is Status.OK
    expected = [vehicle.restart().position, *(vehicle.step(VOLTS).position for _ in range(10))]
    np.testing.assert_array_equal(positions(seen), expected)
    stamps = [nanoseconds_of(one.header.stamp) for one in seen]
    assert stamps == [50_000_000 * k for k in range(11)]
    assert [nanoseconds_of(one.clock) for one in other.clock.take()] == stamps[-10:]  # a reader keeps ten
    imu = other.imu.take()[-1]
    assert imu.header.frame_id == "base_link" and nanoseconds_of(imu.header.stamp) == stamps[-1]


def test_a_command_before_the_odometry_is_no_answer_to_it(setup, vehicle):
    node, other, said = setup(pace="lock-step", duration=0.05)
    other.thrusters.publish(thrusters_of(np.full(8, 1.0), ""))
    until(lambda: node._link.wait(0.0))
    running, seen = Running(node.run), []
    for _ in range(2):
        seen += until(other.odometry.take)
        other.thrusters.publish(thrusters_of(VOLTS, ""))
    running.join(10)
    vehicle.restart()
    np.testing.assert_array_equal(positions(seen)[1], vehicle.step(VOLTS).position)
    assert said.warnings == ["Warning: a command came before its odometry: it is ignored"]


def test_without_a_controller_it_drifts_with_the_current(setup, vehicle):
    node, other, said = setup(pace="fast", duration=0.4)
    assert node.run() is Status.OK
    found = positions(until(other.odometry.take))
    expected = [vehicle.restart().position, *(vehicle.step(np.zeros(8)).position for _ in range(8))]
    np.testing.assert_array_equal(found, expected)
    assert found[-1, 0] > 0 and not said.warnings


def test_a_vehicle_that_leaves_the_envelope_ends_the_run(domain):
    """A kilometre from the origin numbers are taken for an error, as in a simulation."""
    away = {"initial": {"position": [999.9, 0, 0, 0, 0, 0], "velocity": [5, 0, 0, 0, 0, 0]}}
    vehicle = Vehicle(build(SCENARIO | away), attitude="quaternion")
    with Link(domain, True) as link:
        node = VehicleNode(vehicle, link, VehicleSettings("fast"), Reporter(Said()))
        status = node.run()
    assert status is Status(int(ut.simulate_scenario(SCENARIO | away).status)) and status is not Status.OK
    assert node.status().startswith("0.1 s simulated")


def test_real_time_is_that_of_this_machine(setup):
    node, other, _ = setup(duration=1.0)
    other.thrusters.publish(thrusters_of(VOLTS, ""))
    began = time.monotonic()
    node.run()
    assert 0.95 < time.monotonic() - began < 3
    assert node.status().startswith("1.0 s simulated, 21 odometry, 1 commands")


def test_no_input_without_commands(setup):
    """A command is applied for `max_age`, then none; the vehicle slows down, and goes on with the next command."""
    node, other, said = setup(duration=1.0, max_age=0.2)
    other.thrusters.publish(thrusters_of(VOLTS, "thrusters [V]"))
    node.run()
    assert "Warning: no command for 0.2 s: no input is applied until there is one again" in said.warnings


@pytest.mark.parametrize(
    "message, said",
    [
        (thrusters_of(np.zeros(6), ""), "`/thrusters data` must have 8 entries, one per thruster, but is 6 long"),
        (thrusters_of(np.full(8, np.nan), ""), "`/thrusters data` must be finite numbers"),
        (thrusters_of(np.zeros(8), "thrusters [us]"), "must be `thrusters [V]`, but is `thrusters [us]`"),
    ],
)
def test_commands_that_cannot_be_used(setup, message, said):
    """In lock step they end the run; otherwise they are ignored."""
    node, other, lines = setup(duration=0.2)
    other.thrusters.publish(message)
    node.run()
    first = lines.warnings[0]
    assert said in first and first.endswith("The command is ignored")
    node, other, _ = setup(pace="lock-step")
    running = Running(node.run)
    until(other.odometry.take)
    other.thrusters.publish(message)
    running.join(10)
    assert isinstance(running.result, BadInput) and said in str(running.result)


def test_lock_step_ends_without_a_controller(setup, vehicle, empty_domain):
    node, _, _ = setup(pace="lock-step", patience=0.3)
    with pytest.raises(BadInput, match=r"No command came for the odometry of 0 s within 0.3 s"):
        node.run()
    with Link(empty_domain, True) as alone:
        node = VehicleNode(vehicle, alone, VehicleSettings("lock-step", first_patience=0.3), Reporter(Said()))
        with pytest.raises(BadInput, match="No controller: "):
            node.run()


def test_what_a_vehicle_node_cannot_be_made_of(vehicle, domain):
    cases = [
        ({"pace": "slow"}, "`pace` must be one of real-time, lock-step, fast"),
        ({"duration": -1.0}, "`duration` must be positive"),
        ({"duration": 0.01}, r"`duration` must be at least one control step \(0.05 s\)"),
        ({"max_age": 0.0}, "`max_age` must be positive"),
    ]
    with Link(domain, True) as link:
        for settings, said in cases:
            with pytest.raises(BadInput, match=said):
                VehicleNode(vehicle, link, VehicleSettings(**settings), Reporter(Said()))
    with pytest.raises(BadInput, match=r"`loop\.kind` must be sampled"):
        check_vehicle(build(SCENARIO | {"loop": {"kind": "continuous", "dt": 0.01, "record": 0.01}}))
    with pytest.raises(BadInput, match=r"`command` must have shape \(8,\)"):
        vehicle.step(np.zeros(3))
