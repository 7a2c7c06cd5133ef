"""`undertow ardupilot` with an autopilot at the other end of the socket, and what goes wrong with sockets."""

import re
import signal
import socket
import subprocess
import sys
import threading

import numpy as np
import pytest
from driven_scenario import DRIVEN
from fake_autopilot import FakeAutopilot, vector

from undertow.cli.main import run
from undertow.outside.ardupilot.server import listen, serve, status_line
from undertow.outside.ardupilot.session import Session
from undertow.outside.realtime.loop_statistics import Durations
from undertow.outside.thruster_channels import channels_of_vehicle

pytestmark = pytest.mark.interop


@pytest.fixture
def session(vehicle):
    return Session(vehicle, channels_of_vehicle(np.asarray(vehicle.plant.thruster_matrix)))


def served(session, link, **options):
    thread = threading.Thread(target=serve, args=(session, link), kwargs=options, daemon=True)
    thread.start()
    return thread


def test_an_autopilot_holds_depth_and_heading(session):
    """In a current, from a tilted start. A motor that pushed the other way would make it diverge."""
    with listen(port=0) as link, FakeAutopilot(link.getsockname(), 100, depth=1.5, heading=1.0) as autopilot:
        thread = served(session, link, duration=30.0)
        for _ in range(3000):
            autopilot.exchange()
            autopilot.control()
        thread.join(10)
    assert not thread.is_alive() and session.counts["frames"] == 3000
    assert vector(autopilot.text, "position")[2] == pytest.approx(1.5, abs=0.02)
    np.testing.assert_allclose(autopilot.angles(), [0, 0, 1.0], atol=0.03)
    assert '"timestamp":30.0,' in autopilot.text


def test_copies_that_wait_get_one_reply(session):
    """ArduPilot takes any reply for the one to its last packet: a second one would put it a frame behind for good."""
    frame = lambda count: b"\x1a\x48\x64\x00" + count.to_bytes(4, "little") + bytes(32)  # 100 Hz
    with listen(port=0) as link, FakeAutopilot(link.getsockname(), 100, 1.0, 0.0) as autopilot:
        for _ in range(5):
            autopilot.link.sendto(frame(0), link.getsockname())
        thread = served(session, link, duration=0.02)
        autopilot.link.settimeout(10)
        assert b'"timestamp":0.01,' in autopilot.link.recv(65000)
        autopilot.link.sendto(frame(1), link.getsockname())
        assert b'"timestamp":0.02,' in autopilot.link.recv(65000)
        thread.join(10)
        assert session.counts["repeated"] == 4
        autopilot.link.settimeout(0.2)
        with pytest.raises(TimeoutError):
            autopilot.link.recv(65000)


def test_status_lines(session):
    lines = []
    with listen(port=0) as link, FakeAutopilot(link.getsockname(), 100, 1.0, 0.0) as autopilot:
        thread = served(session, link, duration=0.03, report=lines.append, every=0.05)
        while not lines:
            thread.join(0.01)
        autopilot.link.sendto(b"hello", link.getsockname())
        while "other packets" not in lines[-1]:
            thread.join(0.01)
        for _ in range(3):
            autopilot.exchange()
        thread.join(10)
    assert lines[0] == "waiting for ArduPilot"
    assert "waiting for ArduPilot; 1 other packets: `packet` must begin with 18458 or 29569, but is 25960" in lines
    said = status_line(session, Durations())
    assert re.match(
        r"0\.0 s; 100 Hz; north 0\.1\d m, east -0\.\d\d m, down 0\.3\d m; reply no step yet; invalid 1", said
    )


def test_a_vehicle_that_leaves_the_plausible_range_ends_the_command(written, capsys):
    """Beyond a kilometre: exit code 1, as of a simulation, and a line that says so."""
    path = written(DRIVEN | {"initial": {"position": [999.99, 0, 0, 0, 0, 0], "velocity": [2, 0, 0, 0, 0, 0]}})
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as free:
        free.bind(("127.0.0.1", 0))
        port = free.getsockname()[1]

    ended = threading.Event()

    def send():
        packet = b"\x1a\x48\x64\x00" + bytes(36)  # 100 Hz, frame 0
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as autopilot:
            while not ended.wait(0.1):
                autopilot.sendto(packet, ("127.0.0.1", port))

    thread = threading.Thread(target=send)
    thread.start()
    try:
        assert run(["ardupilot", str(path), "--port", str(port)]) == 1
    finally:
        ended.set()
        thread.join(10)
    said = capsys.readouterr().err
    assert said.startswith("Error: the vehicle ended as `diverged` at 0.01 s. ") and said.count("\n") == 1


def test_a_port_that_is_taken(driven, capsys):
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as other:
        other.bind(("127.0.0.1", 0))
        port = other.getsockname()[1]
        assert run(["ardupilot", str(driven), "--port", str(port)]) == 2
    assert (
        f"`port` must be free to listen on, but is 127.0.0.1:{port}: Address already in use" in capsys.readouterr().err
    )


@pytest.mark.parametrize(
    "arguments, said",
    [
        (["--port", "70000"], "`port` must be from 0 to 65535, but is 70000"),
        (["--address", "203.0.113.7"], "`port` must be free to listen on"),
        (["--channels", "1,2"], "`channels` must have 8 entries"),
        (["--frame", "vectored"], "`frame` must have the thrusters of the vehicle"),
        (["--depth", "nan"], "`depth` must be a finite number"),
        (["--duration", "0"], "`duration` must be positive"),
    ],
)
def test_wrong_options(driven, capsys, arguments, said):
    assert run(["ardupilot", str(driven), *arguments]) == 2
    assert said in capsys.readouterr().err


@pytest.mark.parametrize("how", [signal.SIGINT, signal.SIGTERM])
def test_ctrl_c_ends_it(driven, how):
    """The exit code of an interrupted command; nothing but the line that says so on stderr."""
    command = [sys.executable, "-m", "undertow", "ardupilot", str(driven), "--port", "0"]
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as process:
        assert process.stdout is not None and process.stderr is not None
        for line in process.stdout:
            if found := re.search(r"Listening on UDP 127\.0\.0\.1:(\d+)", line):
                break
        with FakeAutopilot(("127.0.0.1", int(found[1])), 100, 1.0, 0.0) as autopilot:
            autopilot.exchange()
        process.send_signal(how)
        assert process.wait(20) == 128 + how
        assert process.stderr.read().strip() == "Interrupted: stopping."
