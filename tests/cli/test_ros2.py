"""`undertow ros2` as users run it: two processes on one machine, Ctrl-C, and errors of one line."""

import os
import signal
import subprocess
import sys
import time

import numpy as np
import pytest

import undertow as ut
from undertow.cli.main import run
from undertow.outside.ros2 import read_rosbag2

pytestmark = pytest.mark.full

SCENARIO = """
plant: {vehicle: odin, thruster: {kind: paper_table3, fidelity: shaft, supply: 24}}
controller: {kind: pid, frequency: 1.0}
reference: {kind: setpoint, position: [1, 0.5, 0.3, 0, 0, 0.4], settling: 2}
loop: {duration: 2, dt: 0.02, record: 0.02}
"""


@pytest.fixture
def scenario(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "odin.yaml").write_text(SCENARIO)
    return tmp_path / "odin.yaml"


def started(*arguments):
    environment = os.environ | {"ROS_DOMAIN_ID": str(100 + os.getpid() % 100), "ROS_LOCALHOST_ONLY": "1"}
    command = [sys.executable, "-m", "undertow", "ros2", "odin.yaml", *arguments]
    return subprocess.Popen(command, env=environment, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)


def test_two_processes_give_the_run_of_a_simulation_and_ctrl_c_ends_them(scenario):
    """The vehicle ends by itself; the controller is interrupted, and its last command is zero thrust."""
    controller = started("--use-sim-time", "--bag", "seen", "--storage", "sqlite3")
    vehicle = started("--as", "vehicle", "--pace", "lock-step", "--bag", "run")
    out, error = vehicle.communicate(timeout=120)
    assert vehicle.returncode == 0, error
    assert "ended: 2.0 s simulated, 101 odometry, 101 commands" in out
    time.sleep(1.2)  # a status line more
    controller.send_signal(signal.SIGINT)
    out, error = controller.communicate(timeout=60)
    assert controller.returncode == 130 and "Interrupted" in error
    assert "odometry 101; commands 102" in out and "The last command is the safe output" in out

    record, found = ut.simulate_scenario(scenario).dataset, read_rosbag2("run")
    np.testing.assert_allclose(found["/odom/position"][1], record["position"].values[:, :3], rtol=0, atol=1e-12)
    np.testing.assert_allclose(found["/thrusters"][1], record["input"].values, rtol=0, atol=1e-9)
    sent = read_rosbag2("seen")["/thrusters"][1]
    np.testing.assert_array_equal(sent[:-1], found["/thrusters"][1])
    assert not sent[-1].any()


@pytest.mark.parametrize(
    "arguments, said",
    [
        (["--as", "pilot"], "`--as` must be one of controller, vehicle"),
        (["--pace", "fast"], "`--pace` must be left out with --as controller"),
        (["--as", "vehicle", "--output", "wrench"], "`--output` must be left out with --as vehicle"),
        (["--as", "vehicle", "--use-sim-time"], "`--use-sim-time` must be left out with --as vehicle"),
        (["--remap", "odom"], "`--remap` must be of the form odom:=/vehicle/odometry, but is odom"),
        (["--storage", "db3", "--bag", "x"], "`storage` must be one of mcap, sqlite3"),
        (["--bag", "."], "`.` must be a new folder, but is there already"),
        (["--rate", "0"], "`rate` must be positive, but is 0 Hz"),
        (["--as", "vehicle", "--rate", "-1"], "`--rate` must be positive, but is -1 Hz"),
        (["--duration", "-1"], "`--duration` must be positive, but is -1 s"),
        (["--domain", "500"], "`domain` must be 0 to 232"),
        (["--reliability", "some"], "`reliability` must be one of reliable, best-effort"),
    ],
)
def test_what_is_wrong(scenario, capsys, arguments, said):
    assert run(["ros2", "odin.yaml", *arguments]) == 2
    error = capsys.readouterr().err
    assert said in error and error.count("\n") == 1
    assert not (scenario.parent / "x").exists()


def test_a_domain_that_is_no_number(scenario, capsys, monkeypatch):
    monkeypatch.setenv("ROS_DOMAIN_ID", "home")
    assert run(["ros2", "odin.yaml"]) == 2
    assert "`ROS_DOMAIN_ID` must be a whole number, but is 'home'" in capsys.readouterr().err


def test_a_network_that_is_not_there(scenario):
    """In a process of its own: CycloneDDS reads its configuration once."""
    interfaces = "<Interfaces><NetworkInterface name='nowhere0'/></Interfaces>"
    uri = f"<CycloneDDS><Domain><General>{interfaces}</General></Domain></CycloneDDS>"
    environment = os.environ | {"CYCLONEDDS_URI": uri}
    command = [sys.executable, "-m", "undertow", "ros2", "odin.yaml", "--domain", "3", "--duration", "1"]
    done = subprocess.run(command, env=environment, capture_output=True, text=True, timeout=120)
    assert done.returncode == 2
    last = done.stderr.splitlines()[-1]
    assert last.startswith("Error: No DDS participant could be made in domain 3: ") and "CYCLONEDDS_URI" in last


def test_without_cyclonedds(scenario, capsys, monkeypatch):
    """As where the extra is not installed."""
    for name in [name for name in sys.modules if name.startswith(("undertow.outside.ros2", "undertow.cli.ros2"))]:
        monkeypatch.delitem(sys.modules, name)
    monkeypatch.setattr("importlib.util.find_spec", lambda name: None)
    assert run(["ros2", "odin.yaml"]) == 2
    error = capsys.readouterr().err
    assert error == (
        "Error: Rosbags is not installed. In the folder of undertow, run: pip install -c constraints.txt '.[ros2]'\n"
    )
