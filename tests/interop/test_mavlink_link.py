"""`undertow mavlink` with pymavlink as the vehicle at the other end of the socket: a closed loop, and what goes wrong."""

import contextlib
import re
import signal
import socket
import subprocess
import sys
import threading
import time

import numpy as np
import pytest
from driven_scenario import DRIVEN
from mavlink_vehicle import MavlinkVehicle

import undertow as ut
from undertow.cli.main import run
from undertow.core.errors import BadInput
from undertow.outside.mavlink import Companion, CompanionLink, UdpLink
from undertow.outside.realtime.control_loop import RealTimeLoop
from undertow.outside.realtime.loop_clock import MonotonicClock
from undertow.outside.realtime.loop_settings import LoopSettings
from undertow.outside.realtime.sender_clock import SenderClock

pytestmark = pytest.mark.interop

FRAMES = round(DRIVEN["loop"]["duration"] / DRIVEN["loop"]["dt"])
# m and m/s. Odometry holds single precision, and commands whole microseconds: as long as no command lies on the edge
# between two, nothing differs at all. One that does is 0.04 V in one step: less than this.
CLOSE = 2e-5


@pytest.fixture(scope="module")
def companion(driven):
    """Starts at once, as a simulation does."""
    return Companion(driven, timeout=5.0)


@contextlib.contextmanager
def accompanied(companion, link, **options):
    """The companion talks in a thread, until the block ends; the clock of its vehicle is a new one."""
    companion._clock = SenderClock(companion.timeout)
    ended, settings = threading.Event(), LoopSettings(max_age=companion.timeout)
    paced = CompanionLink(companion, link)
    loop = RealTimeLoop(companion.autopilot, paced, MonotonicClock(), settings, ended.is_set, **options)
    thread = threading.Thread(target=loop.run)
    thread.start()
    try:
        yield loop
    finally:
        ended.set()
        thread.join(10)


def closed_loop(vehicle, peer, send):
    """Positions of the vehicle as its own odometry and the companion's commands move it."""
    found = []
    for frame in range(FRAMES):
        if frame % 20 == 0:
            peer.heartbeat()
        state = vehicle.state()
        found.append(np.concatenate([state.position, state.velocity]))
        send(frame, state)
        vehicle.step(peer.pulses(), 0.01)
    return np.array(found)


@pytest.mark.parametrize("source", ["odometry", "local_position"])
@pytest.mark.parametrize("listens", ["companion", "vehicle"])
def test_a_closed_loop_is_that_of_a_simulation(driven, vehicle, source, listens):
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as free:
        free.bind(("127.0.0.1", 0))
        place = f"127.0.0.1:{free.getsockname()[1]}"
    companion = Companion(driven, source=source, timeout=5.0)
    kinds = ("udpin", "udpout") if listens == "companion" else ("udpout", "udpin")
    first, second = (lambda: UdpLink(f"{kinds[0]}:{place}")), (lambda: MavlinkVehicle(f"{kinds[1]}:{place}"))
    with first() as link, second() as peer:
        with accompanied(companion, link) as loop:
            if listens == "vehicle":
                assert peer.wait("HEARTBEAT").get_srcSystem() == 255
            if source == "odometry":
                send = lambda frame, state: peer.odometry(5_000_000 + 10_000 * frame, state)
            else:
                send = lambda frame, state: peer.position_and_attitude(5_000 + 10 * frame, state)
            found = closed_loop(vehicle, peer, send)
    assert not any(companion.counts.values()) and loop.statistics.steps == FRAMES
    assert loop.session.counts == dict.fromkeys(loop.session.counts, 0) | {"starts": 1}
    timing = companion.autopilot.counts
    assert timing == dict.fromkeys(timing, 0) | {"steps": FRAMES - 1}
    run = ut.simulate_scenario(DRIVEN).dataset
    expected = np.concatenate([run["position"].values[:-1, :3], run["velocity"].values[:-1, :3]], axis=1)
    np.testing.assert_allclose(found, expected, rtol=0, atol=CLOSE)
    assert np.abs(expected[-1] - expected[0]).max() > 0.2  # it has moved a thousand times as far


def test_every_step_is_logged_and_replayed(driven, companion, vehicle, tmp_path, capsys):
    """Also where the controller begins again."""
    log = tmp_path / "dive.mcap"
    companion.autopilot.log_to(log)
    with UdpLink("udpin:127.0.0.1:0") as link, MavlinkVehicle(f"udpout:127.0.0.1:{link.port}") as peer:
        with accompanied(companion, link) as loop:
            peer.heartbeat()
            for step in range(30):
                peer.odometry(1_000_000 + 10_000 * step, vehicle.state(), resets=step // 15)
                peer.pulses()
    companion.autopilot.close_log()
    assert loop.session.counts["starts"] == 2
    assert run(["run", str(driven), "--link", f"log:{log}"]) == 0
    assert "30 steps replayed: every bit of the commands is that of the log" in capsys.readouterr().out


def test_what_is_sent_last_is_neutral(companion, vehicle):
    """However the loop ends; three times, because datagrams may be lost."""
    with UdpLink("udpin:127.0.0.1:0") as link, MavlinkVehicle(f"udpout:127.0.0.1:{link.port}") as peer:
        with accompanied(companion, link):
            peer.heartbeat()
            peer.odometry(1_000_000, vehicle.state())
            assert (peer.pulses() != 1500).any()
        for _ in range(3):
            assert (peer.pulses() == 1500).all()
        assert peer.wait("RC_CHANNELS_OVERRIDE", timeout=0.2) is None


def test_another_sender_with_the_same_system_id_is_ignored(companion, vehicle):
    """While the vehicle talks: the commands go to it, and not to the other one."""
    with UdpLink("udpin:127.0.0.1:0") as link, MavlinkVehicle(f"udpout:127.0.0.1:{link.port}") as peer:
        with MavlinkVehicle(f"udpout:127.0.0.1:{link.port}") as other, accompanied(companion, link) as loop:
            peer.heartbeat()
            peer.odometry(20_000_000, vehicle.state())
            peer.pulses()
            steps = loop.statistics.steps
            other.heartbeat(armed=False)
            other.odometry(20_010_000, vehicle.state())
            peer.odometry(20_020_000, vehicle.state())
            peer.pulses()
            assert loop.statistics.steps == steps + 1 and companion.armed
            assert other.wait("RC_CHANNELS_OVERRIDE", timeout=0.2) is None


def test_a_network_that_takes_nothing(companion):
    """Commands are lost and counted; the loop goes on."""
    with UdpLink("udpin:127.0.0.1:0") as link:
        link.peer = "127.0.0.1", 0  # no port to send to
        link.send(companion.neutral())
        assert link.unsent == len(companion.neutral()) > 0


def test_status_lines(companion, vehicle):
    lines = []
    with UdpLink("udpin:127.0.0.1:0") as link, MavlinkVehicle(f"udpout:127.0.0.1:{link.port}") as peer:
        with accompanied(companion, link, report=lines.append, every=0.2):
            peer.heartbeat()
            peer.odometry(40_000_000, vehicle.state(), frames=(4, 12))
            while not (lines and "MAV_FRAME_LOCAL_ENU" in lines[-1]):
                assert len(lines) < 50
                threading.Event().wait(0.05)
    assert re.match(r"(no valid measurement|running, [A-Z]+( \(.*\))?); \d+ Hz; step (p50 \d|no step)", lines[-1])


@pytest.mark.parametrize(
    "place",
    [
        "serial:/dev/ttyACM0",
        "udpin:127.0.0.1",
        "udpin:127.0.0.1:70000",
        "udpin::14550",
        "14550",
        "/dev/ttyACM0,115200",
        "udpout:127.0.0.1:0",
    ],
)
def test_places_that_are_none(place):
    with pytest.raises(BadInput, match="`connect` must be udpin:HOST:PORT or udpout:HOST:PORT, but is"):
        UdpLink(place)


def test_a_place_that_is_taken(driven, capsys):
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as other:
        other.bind(("127.0.0.1", 0))
        place = f"udp:127.0.0.1:{other.getsockname()[1]}"
        assert run(["mavlink", str(driven), "--connect", place]) == 2
    assert f"`connect` must be free to use, but is {place}: Address already in use" in capsys.readouterr().err


def test_a_vehicle_that_is_not_there(driven):
    """Nobody listens at the other end: heartbeats go nowhere, and nothing happens."""
    assert run(["mavlink", str(driven), "--connect", "udpout:127.0.0.1:9", "--duration", "0.3"]) == 0


@pytest.mark.parametrize(
    "options, said",
    [
        (["--output", "pwm"], "`output` must be one of rc_override, servo, actuator, control_target"),
        (["--input", "gps"], "`input` must be one of odometry, local_position"),
        (["--system", "0"], "`system` must be from 1 to 255"),
        (["--channels", "1,2"], "`channels` must have 8 entries"),
        (["--duration", "-1"], "`duration` must be positive"),
    ],
)
def test_wrong_options(driven, capsys, options, said):
    assert run(["mavlink", str(driven), "--connect", "udpin:127.0.0.1:0", *options]) == 2
    assert said in capsys.readouterr().err


def test_without_pymavlink(driven):
    code = f"""
import sys
sys.modules["pymavlink"] = None
from undertow.cli.main import run
sys.exit(run(["mavlink", {str(driven)!r}, "--connect", "udpin:127.0.0.1:0"]))
"""
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
    assert done.returncode == 2
    assert done.stderr.startswith("Error: Pymavlink is not installed. In the folder of undertow, run: pip install")


def test_another_vehicles_file(written, capsys):
    pendulum = {
        "plant": "inverted_pendulum",
        "reference": {"kind": "setpoint", "position": [0]},
        "loop": {"duration": 1.0, "dt": 0.01},
    }
    path = written(pendulum)
    for command in (["ardupilot", str(path)], ["mavlink", str(path), "--connect", "udpin:127.0.0.1:0"]):
        assert run(command) == 2
        assert "`plant` must be a vehicle with thrusters, but is InvertedPendulum" in capsys.readouterr().err


def command(driven, port=0):
    connect = f"udpin:127.0.0.1:{port}"
    return [sys.executable, "-m", "undertow", "mavlink", str(driven), "--connect", connect]


@contextlib.contextmanager
def controlling(driven, vehicle):
    """The command, with thrusters that turn, and the vehicle that it talks with."""
    pipe = subprocess.PIPE
    hung_up = signal.getsignal(signal.SIGHUP)
    signal.signal(signal.SIGHUP, signal.SIG_DFL)  # as in a terminal: tests may run under `nohup`
    started = subprocess.Popen(command(driven), stdout=pipe, stderr=pipe, text=True)
    signal.signal(signal.SIGHUP, hung_up)
    with started as process:
        try:
            assert process.stdout is not None and process.stderr is not None
            for line in process.stdout:
                if found := re.search(r"MAVLink on UDP port (\d+)", line):
                    break
            with MavlinkVehicle(f"udpout:127.0.0.1:{found[1]}") as peer:
                peer.heartbeat()
                peer.odometry(1_000_000, vehicle.state())
                peer.pulses()
                yield process, peer
        finally:
            process.kill()


def ends_neutral(peer):
    """Whether the last command that comes is neutral; False without any."""
    last = None
    while (message := peer.wait("RC_CHANNELS_OVERRIDE", timeout=0.6)) is not None:
        last = message
    return last is not None and [getattr(last, f"chan{n}_raw") for n in range(1, 9)] == [1500] * 8


@pytest.mark.parametrize("how", [signal.SIGINT, signal.SIGHUP, signal.SIGQUIT])
def test_signals_end_it_with_neutral_commands(driven, vehicle, how):
    with controlling(driven, vehicle) as (process, peer):
        process.send_signal(how)
        assert process.wait(20) == 128 + how
        assert ends_neutral(peer)
        assert process.stderr.read().strip() == "Interrupted: stopping."


def test_a_watchdog_sends_neutral_commands_where_the_controller_cannot(driven, vehicle):
    """It stands still, as on a machine that swaps, and is killed, as where memory ran out."""
    with controlling(driven, vehicle) as (process, peer):
        process.send_signal(signal.SIGSTOP)
        stopped = [peer.wait("RC_CHANNELS_OVERRIDE", timeout=1.0) for _ in range(3)]
        assert all(message is not None and message.chan1_raw == 1500 for message in stopped)
        process.kill()
        assert process.wait(20) == -signal.SIGKILL
        assert ends_neutral(peer)
        assert peer.wait("RC_CHANNELS_OVERRIDE", timeout=1.0) is None  # the watchdog has ended, too


def test_lines_that_cannot_be_printed_do_not_end_control(driven, vehicle):
    """Nobody reads them any more, as on a full disk; there is one every second."""
    with controlling(driven, vehicle) as (process, peer):
        process.stdout.close()
        until = time.monotonic() + 2.5
        for k in range(1, 1000):
            peer.heartbeat()
            peer.odometry(1_000_000 + 10_000 * k, vehicle.state())
            assert peer.wait("RC_CHANNELS_OVERRIDE", timeout=5.0) is not None
            if time.monotonic() > until:
                break
            time.sleep(0.01)
        process.send_signal(signal.SIGINT)
        assert process.wait(20) == 128 + signal.SIGINT
        assert ends_neutral(peer)
