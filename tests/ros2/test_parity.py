"""Vehicle and controller as nodes, in lock step over the loopback interface, give the run of a simulation."""

import contextlib
import threading
from pathlib import Path

import numpy as np
import pytest
from peer import ControllerNode

import undertow as ut
from undertow.core.status import Status
from undertow.logs.background_writer import BackgroundWriter
from undertow.outside.autopilot.vehicle import Vehicle
from undertow.outside.ros2 import from_messages, read_rosbag2, to_messages
from undertow.outside.ros2.compiled_controller import CompiledController
from undertow.outside.ros2.controller_link import ControllerSettings
from undertow.outside.ros2.from_messages import Frames, PoseAndVelocity, motion_of
from undertow.outside.ros2.link import Link
from undertow.outside.ros2.node import Reporter
from undertow.outside.ros2.to_messages import odometry_of, stamp_of
from undertow.outside.ros2.vehicle_node import VehicleNode, VehicleSettings
from undertow.outside.ros2.write_bag import BagWriter
from undertow.scenario.build import build
from undertow.scenario.reading import read

pytestmark = pytest.mark.interop

# Thrusters reach their limits at the start.
SCENARIO = """
plant: {vehicle: bluerov2_heavy, thruster: {kind: t200, supply: 16}}
controller: {kind: rcaf, preset: robust}
reference: {kind: setpoint, position: [4, 1, 1, 0, 0, 0.5], settling: 2}
disturbance: {kind: current, velocity: [0.3, 0.2, 0]}
loop: {duration: 2, dt: 0.01, record: 0.01}
"""


@pytest.fixture(scope="module")
def scenario(tmp_path_factory) -> Path:
    path = tmp_path_factory.mktemp("parity") / "heavy.yaml"
    path.write_text(SCENARIO)
    return path


@pytest.fixture(scope="module")
def controller(scenario):
    return CompiledController(scenario)


@pytest.fixture(scope="module")
def vehicle(scenario):
    return Vehicle(build(read(scenario)), attitude="quaternion")


@pytest.fixture(scope="module")
def simulated(scenario):
    return ut.simulate_scenario(scenario).dataset


def lock_step(controller, vehicle, domain, folder):
    """Run both nodes, and return what the vehicle's side saw; in its own thread the controller answers."""
    quiet, done = Reporter(lambda line: None), threading.Event()
    bag = BackgroundWriter(BagWriter(folder).open)
    with contextlib.closing(bag), Link(domain, True) as one, Link(domain, True, bag=bag) as other:
        node = ControllerNode(controller, one, ControllerSettings(use_sim_time=True), quiet)
        running = VehicleNode(vehicle, other, VehicleSettings("lock-step"), quiet)

        def answer():
            while not done.is_set():
                node.spin(0.05)

        thread = threading.Thread(target=answer)
        thread.start()
        try:
            assert running.run() is Status.OK
        finally:
            done.set()
            thread.join()
    assert not any(quiet.counts.values())
    return {name: values for name, (_, values) in read_rosbag2(folder).items()}


def test_all_bits_but_the_rounding_of_attitudes(controller, vehicle, simulated, domain, tmp_path, monkeypatch):
    """With attitudes passed on as they are (which is wrong in ROS), every bit is that of the simulation."""
    for module in (from_messages, to_messages):
        monkeypatch.setattr(module, "between_attitudes", lambda quaternion: np.asarray(quaternion, dtype=float))
    found = lock_step(controller, vehicle, domain, tmp_path / "bag")
    np.testing.assert_array_equal(found["/odom/position"], simulated["position"].values[:, :3])
    np.testing.assert_array_equal(found["/thrusters"], simulated["input"].values)
    assert simulated["saturated"].values.any()


def as_odometry(observed):
    """What a law gets of a motion after its way through a message: axes and attitudes are turned there and back."""
    motion = PoseAndVelocity(observed.position, observed.attitude, observed.velocity)
    arrived = motion_of(odometry_of(motion, stamp_of(0), Frames()), Frames(), "/odom")
    return arrived.position, arrived.velocity, arrived.quaternion


def test_a_run_over_ros_is_that_of_a_simulation(controller, vehicle, simulated, scenario, domain, tmp_path):
    """With the bits of one loop in this process, whose motions go through the same messages.

    ENU attitudes round by some 1e-16, which is all that differs from a simulation; after 2 s it has grown to 2e-9 V.
    """
    found = lock_step(controller, vehicle, domain, tmp_path / "bag")
    autopilot, observed = ut.Autopilot(scenario, attitude="quaternion"), vehicle.restart()
    positions, commands = [observed.position], [np.clip(autopilot.start(*as_odometry(observed)), -16, 16)]
    for _ in found["/thrusters"][1:]:
        observed = vehicle.step(commands[-1])
        positions.append(observed.position)
        commands.append(np.clip(autopilot.step(*as_odometry(observed), applied=commands[-1]), -16, 16))
    np.testing.assert_array_equal(commands, found["/thrusters"])
    np.testing.assert_array_equal(positions, found["/odom/position"])
    np.testing.assert_allclose(commands, simulated["input"].values, rtol=0, atol=1e-8)
    np.testing.assert_allclose(positions, simulated["position"].values[:, :3], rtol=0, atol=1e-11)


def test_noise_and_substeps_are_those_of_a_simulation():
    scenario = {
        "plant": {"vehicle": "odin", "thruster": {"kind": "paper_table3", "fidelity": "shaft", "supply": 24}},
        "controller": {"kind": "pid", "frequency": 1.0},
        "reference": {"kind": "setpoint", "position": [1, 0, 1, 0, 0, 0.5], "settling": 2},
        "navigation": {"kind": "white_noise", "position": 0.001, "velocity": 0.01},
        "loop": {"duration": 1, "dt": 0.01, "record": 0.01, "substeps": 3},
    }
    record = ut.simulate_scenario(scenario).dataset
    vehicle = Vehicle(build(scenario), attitude="quaternion")
    observed = [vehicle.restart(), *map(vehicle.step, record["commanded_input"].values[:-1])]
    measured = np.array([one.position for one in observed])
    np.testing.assert_array_equal(measured, record["measured_position"].values[:, :3])
    np.testing.assert_array_equal([one.applied for one in observed[1:]], record["input"].values[:-1])
    assert np.abs(measured - record["position"].values[:, :3]).max() > 1e-3  # there is noise


def test_an_imu_measures_what_the_motion_says(vehicle, simulated):
    """Specific force: the change of the true velocity over a step, less gravity, in body axes of the middle of the step."""
    from scipy.spatial.transform import Rotation

    observed = [vehicle.restart(), *map(vehicle.step, simulated["commanded_input"].values[:-1])]
    rate = np.diff(simulated["velocity"].values[:, :3], axis=0) / 0.01
    turned = Rotation.from_quat([one.attitude for one in observed[1:]], scalar_first=True)
    at_end = turned.inv().apply(rate - [0, 0, 9.81])
    expected = at_end + 0.005 * np.cross([one.velocity[3:] for one in observed[1:]], at_end)
    np.testing.assert_allclose([one.specific_force for one in observed[1:]], expected, atol=1e-9)
