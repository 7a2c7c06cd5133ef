"""`undertow run` as users run it: results, replay, Ctrl-C, SIGTERM, kill -9, and errors of one line."""

import errno
import json
import os
import signal
import socket
import subprocess
import sys
import threading
import time

import numpy as np
import pytest

import undertow as ut
from undertow.cli.main import run
from undertow.logs.read import read_log
from undertow.outside.realtime.datagrams import COMMAND, MEASUREMENT, DatagramFilter, Sender

pytestmark = pytest.mark.full

SCENARIO = """
plant: {vehicle: bluerov2_heavy, thruster: {kind: t200, supply: 16}}
controller: {kind: pid, frequency: 2.0}
reference: {kind: setpoint, position: [1, 0.5, 0.3, 0, 0, 0.4], settling: 2}
loop: {duration: 0.5, dt: 0.01, record: 0.01}
"""
AXIS = """
plant: {kind: double_integrator, axes: 1, limit: 20}
controller: {kind: pid, frequency: 2.0}
reference: {kind: setpoint, position: [1]}
loop: {duration: 0.5, dt: 0.01, record: 0.01}
"""
AT_REST = np.concatenate([np.zeros(3), [1, 0, 0, 0], np.zeros(6 + 8)])


@pytest.fixture
def scenario(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "rov.yaml").write_text(SCENARIO)
    return tmp_path / "rov.yaml"


def test_a_fast_run_has_the_bits_of_simulate_and_replays(scenario, tmp_path, capsys):
    assert run(["run", "rov.yaml", "--fast", "--json", "--unsupervised"]) == 0
    printed = json.loads(capsys.readouterr().out)
    assert printed == json.loads((tmp_path / "runs/rov/statistics.json").read_text())
    assert (printed["steps"], printed["overruns"], printed["missed"], printed["stale"]) == (50, 0, 0, 0)
    log, record = read_log(tmp_path / "runs/rov/run.mcap"), ut.simulate_scenario(scenario).dataset
    for name in ("measured_position", "measured_velocity", "commanded_input", "reference"):
        np.testing.assert_array_equal(log[name].values, record[name].values[:-1])
    assert run(["run", "rov.yaml", "--link", "log:runs/rov/run.mcap", "--unsupervised"]) == 0
    assert "50 steps replayed: every bit" in capsys.readouterr().out


def test_another_law_differs_from_the_log_and_an_earlier_result_is_kept(scenario, tmp_path, capsys):
    (tmp_path / "axis.yaml").write_text(AXIS)
    assert run(["run", "axis.yaml", "--fast"]) == 0
    (tmp_path / "other.yaml").write_text(AXIS.replace("2.0", "2.5"))
    assert run(["run", "other.yaml", "--link", "log:runs/axis/run.mcap"]) == 1
    captured = capsys.readouterr()
    assert "Commands that differ" in captured.out and "differ from the log" in captured.err
    assert run(["run", "axis.yaml", "--fast", "--out", "runs/axis"]) == 2  # an earlier result is there
    assert "--overwrite" in capsys.readouterr().err


@pytest.mark.parametrize(
    "arguments, said",
    [
        (["--link", "tcp:1"], "must be vehicle, udp:HOST:PORT or log:FILE"),
        (["--link", "udp:"], "must be vehicle, udp:HOST:PORT or log:FILE"),
        (["--link", "udp:host"], "must be HOST:PORT"),
        (["--link", "udp:127.0.0.1:9", "--fast"], "must be left out with a link to a real vehicle"),
        (["--link", "log:none.mcap"], "must be an existing file"),
        (["--link", "log:rov.yaml"], "`log` must"),
        (["--safe", "x"], "`--safe` must be a number"),
        (["--safe", "1,2"], "`--safe` must be one number, or 8"),
        (["--safe", "nan"], "`--safe[0]` must be a finite number"),
        (["--duration", "0"], "`--duration` must be positive"),
        (["--duration", "0.001"], "`--duration` must be at least one sampling time"),
        (["--deadline", "-1"], "`--deadline` must be positive"),
        (["--max-age", "nan"], "`--max-age` must be"),
        (["--priority", "100"], "`--priority` must be from 1 to 99"),
        (["--cpu", "4096"], "`--cpu` must be one of"),
        (["--serve", "nowhere"], "must be HOST:PORT"),
    ],
)
def test_errors_are_one_line_and_leave_nothing(scenario, tmp_path, capsys, arguments, said):
    assert run(["run", "rov.yaml", *arguments]) == 2
    error = capsys.readouterr().err
    assert said in error and error.splitlines()[-1].startswith("Error: "), error
    assert all(line.startswith(("Advice: ", "Error: ")) for line in error.splitlines())
    assert [path.name for path in tmp_path.iterdir()] == ["rov.yaml"]


def test_a_continuous_loop_has_no_steps(scenario, tmp_path, capsys):
    (tmp_path / "continuous.yaml").write_text(SCENARIO.replace("loop: {", "loop: {kind: continuous, "))
    assert run(["run", "continuous.yaml"]) == 2
    assert "loop.kind" in capsys.readouterr().err


class Peer:
    """The vehicle of a process: at rest, and it remembers commands."""

    def __init__(self):
        self.socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self.socket.bind(("127.0.0.1", 0))
        self.place = f"127.0.0.1:{self.socket.getsockname()[1]}"
        self.received, self.sender = DatagramFilter(COMMAND, 8), Sender(MEASUREMENT, 8, 1)
        self.commands = []

    def answer(self, seconds, until=lambda: False):
        """Answer commands for a time, or until something is so."""
        end = time.monotonic() + seconds
        self.socket.settimeout(0.2)
        while time.monotonic() < end and not until():
            try:
                data, sender = self.socket.recvfrom(2048)
            except TimeoutError:
                continue
            command = self.received.take(data)
            if command is not None:
                self.commands.append(command)
                self.socket.sendto(self.sender.pack(AT_REST, 0, command.sequence), sender)


@pytest.fixture
def peer():
    found = Peer()
    yield found
    found.socket.close()


def started(peer, *arguments):
    command = [sys.executable, "-m", "undertow", "run", "rov.yaml", "--link", f"udp:{peer.place}", *arguments]
    return subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, env=dict(os.environ))


def controlled(peer, ended):
    """Answer until control has been going on for a while, or the command has ended."""
    peer.answer(60, until=lambda: sum(not one.flag for one in peer.commands) > 40 or ended())


def ended_with_the_safe_output(folder, peer, out, error):
    assert error.strip().endswith("Interrupted: stopping.") and "Ended: stopped" in out
    assert all((one.values == 0.5).all() for one in peer.commands[-3:])
    assert not (peer.commands[-4].values == 0.5).all()
    found = json.loads((folder / "statistics.json").read_text())
    assert found["steps"] == len(read_log(folder / "run.mcap")["elapsed"].time) > 40


def test_a_signal_ends_it_with_the_safe_output(scenario, tmp_path, peer):
    """SIGTERM, to a process of its own."""
    process = started(peer, "--safe", "0.5", "--max-age", "60")
    controlled(peer, lambda: process.poll() is not None)
    process.send_signal(signal.SIGTERM)
    peer.answer(30, until=lambda: process.poll() is not None)
    peer.answer(0.3)
    out, error = process.communicate(timeout=30)
    assert process.returncode == 143
    ended_with_the_safe_output(tmp_path / "runs/rov", peer, out, error)


def test_nobody_reads_the_output(scenario, tmp_path, peer):
    """The pipe is closed, as by a terminal that is gone: the end is the same, but for its code."""
    process = started(peer, "--safe", "0.5", "--max-age", "60")
    controlled(peer, lambda: process.poll() is not None)
    process.stdout.close()
    process.stderr.close()
    process.send_signal(signal.SIGTERM)
    peer.answer(30, until=lambda: process.poll() is not None)
    peer.answer(0.3)
    assert process.wait(30) == 141
    assert all((one.values == 0.5).all() for one in peer.commands[-3:])
    found = json.loads((tmp_path / "runs/rov/statistics.json").read_text())
    assert found["steps"] == len(read_log(tmp_path / "runs/rov/run.mcap")["elapsed"].time) > 40


def test_ctrl_c_ends_it_with_the_safe_output(scenario, tmp_path, peer, capfd):
    ended = threading.Event()

    def vehicle():
        controlled(peer, ended.is_set)
        if not ended.is_set():
            os.kill(os.getpid(), signal.SIGINT)
        peer.answer(30, until=ended.is_set)

    answering = threading.Thread(target=vehicle)
    answering.start()
    try:
        code = run(["run", "rov.yaml", "--link", f"udp:{peer.place}", "--safe", "0.5", "--max-age", "60"])
    finally:
        ended.set()
        answering.join()
    peer.answer(0.3)
    out, error = capfd.readouterr()
    assert code == 130, (out, error)
    ended_with_the_safe_output(tmp_path / "runs/rov", peer, out, error)


def test_a_lost_vehicle_and_one_that_never_was(scenario, peer, capsys):
    """After a while nobody answers any more; what was sent since then waits in the socket."""
    ended = threading.Event()
    vehicle = threading.Thread(target=controlled, args=(peer, ended.is_set))
    vehicle.start()
    try:
        code = run(["run", "rov.yaml", "--link", f"udp:{peer.place}", "--max-age", "1", "--unsupervised"])
    finally:
        ended.set()
        vehicle.join()
    peer.commands.clear()
    peer.answer(0.3)
    assert code == 1 and "no measurement for 1 s" in capsys.readouterr().err
    assert not peer.commands[-1].values.any() and peer.commands[-4].values.any()


def test_a_killed_process_leaves_a_log_that_replays(scenario, tmp_path, peer, capsys):
    process = started(peer, "--max-age", "60")
    controlled(peer, lambda: process.poll() is not None)
    process.kill()
    process.communicate(timeout=30)
    log = read_log(tmp_path / "runs/rov/run.mcap")
    assert len(log["elapsed"].time) > 10
    assert run(["run", "rov.yaml", "--link", "log:runs/rov/run.mcap"]) == 0
    captured = capsys.readouterr()
    assert "every bit of the commands" in captured.out and "Note:" in captured.err


def test_a_full_disk_does_not_stop_the_controller(scenario, tmp_path):
    """Files end at 20 kB: the run goes on to its end, says so once, and the log is readable up to there."""
    (tmp_path / "axis.yaml").write_text(AXIS)
    code = "import resource, sys; resource.setrlimit(resource.RLIMIT_FSIZE, (20_000, 20_000)); "
    code += "from undertow.cli.main import run; sys.exit(run(['run', 'axis.yaml', '--fast', '--duration', '10']))"
    environment = os.environ | {"UNDERTOW_CACHE": str(tmp_path / "cache")}
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, env=environment)
    assert done.returncode == 4 and "later steps are not recorded" in done.stderr
    assert json.loads((tmp_path / "runs/axis/statistics.json").read_text())["steps"] == 1000
    assert 5 < len(read_log(tmp_path / "runs/axis/run.mcap")["elapsed"].time) < 500


def test_a_disk_that_takes_no_statistics_costs_no_table(scenario, tmp_path, monkeypatch, capsys):
    def full(path, content):
        raise OSError(errno.ENOSPC, "No space left on device")

    (tmp_path / "axis.yaml").write_text(AXIS)
    monkeypatch.setattr("undertow.cli.run.write_whole", full)
    assert run(["run", "axis.yaml", "--fast", "--out", "flight"]) == 4
    said = capsys.readouterr()
    assert "Ended: " in said.out
    assert "flight/statistics.json could not be written: No space left on device" in said.err


def test_without_a_vehicle_nothing_is_written(scenario, tmp_path, peer, capsys):
    assert run(["run", "rov.yaml", "--link", f"udp:{peer.place}", "--patience", "0.05"]) == 1
    assert "no first measurement within 0.05 s" in capsys.readouterr().err
    assert [path.name for path in tmp_path.iterdir()] == ["rov.yaml"]


def test_a_silent_vehicle_costs_no_earlier_flight(scenario, tmp_path, peer, capsys):
    (tmp_path / "axis.yaml").write_text(AXIS)
    assert run(["run", "axis.yaml", "--fast", "--out", "flight"]) == 0
    before = {path.name: path.read_bytes() for path in (tmp_path / "flight").iterdir()}
    silent = ["run", "rov.yaml", "--link", f"udp:{peer.place}", "--patience", "0.05", "--out", "flight", "--overwrite"]
    assert run(silent) == 1
    assert "no first measurement within 0.05 s" in capsys.readouterr().err
    assert {path.name: path.read_bytes() for path in (tmp_path / "flight").iterdir()} == before
