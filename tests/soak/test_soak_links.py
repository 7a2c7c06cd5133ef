"""The attack on link commands: what is sampled, what is judged, and a few runs of the real commands."""

import os
import signal
import time
from pathlib import Path

import numpy as np
import pytest

from soak.kept_commands import kept
from soak.links.command_process import CommandProcess
from soak.links.link_run import LinkRunner
from soak.links.peer import AbstractPeer, Measured, altered
from soak.links.plan import ENDINGS, LINKS, STREAMS, WILD, Event, Plan, plan, signals_of
from soak.links.scenario import PERIOD
from soak.links_soak import attack_links
from undertow.outside.autopilot.measured_motion import MeasuredMotion

pytestmark = pytest.mark.soak

STILL = MeasuredMotion(np.zeros(3), np.array([1.0, 0, 0, 0]), np.zeros(6))


def test_plans_are_sampled_from_their_identity():
    """The same seed and number give the same run, and a few hundred have everything."""
    plans = [plan("run", 5, k) for k in range(400)]
    assert plans == [plan("run", 5, k) for k in range(400)] and plans[1] != plan("run", 6, 1)
    assert {one.ending for one in plans} == set(ENDINGS)
    events = [event for one in plans for event in one.events]
    assert {event.kind for event in events} == {"wild", "stall", *STREAMS}
    assert {event.what for event in events if event.kind == "wild"} == set(WILD)
    assert any(one.disk for one in plans) and any(not one.events for one in plans)
    assert plans[0].events == () and plans[0].disk is None
    assert all(event.first < one.last for one in plans for event in one.events)


def test_at_most_one_wrong_message_is_single():
    of = lambda *events: Plan("links/run/1/1", events, "INT", 40, None, "")
    wild, stall, stream = Event("wild", WILD[0], 30, 1), Event("stall", "", 30, 6), Event("replayed", "", 30, 6)
    assert of().is_single and of(wild).is_single and of(wild, stall).is_single
    assert not of(wild, wild).is_single and not of(stream).is_single


def test_signals_of_endings():
    assert signals_of("INT, TERM") == [signal.SIGINT, signal.SIGTERM]
    assert signals_of("stop") == [signal.SIGSTOP] and signals_of("silence") == []


@pytest.mark.parametrize("what", WILD)
def test_a_wild_measurement_is_wrong_in_one_thing(what):
    measured = Measured(np.ones(3), np.array([0.6, 0.0, 0.0, 0.8]), np.zeros(6))
    found = altered(measured, what)
    changed = [not np.array_equal(a, b) for a, b in zip(measured, found, strict=True)]
    assert sum(changed) == 1
    if what.startswith("heading"):  # about the vertical, so that the vehicle stays level
        angle = 2 * np.arctan2(found.attitude[3], found.attitude[0]) - 2 * np.arctan2(0.8, 0.6)
        assert np.isclose(np.cos(angle), np.cos(3.0)) and np.isclose(np.linalg.norm(found.attitude), 1.0)


def pretended(arguments):
    """In place of `undertow`: an exit code, or what signals make of it."""
    if arguments[0] == "code":
        print("said")
        return int(arguments[1])
    try:
        print("asleep", flush=True)
        time.sleep(60)
    except KeyboardInterrupt:
        return 130
    return 1


def test_the_process_that_is_tested_says_how_a_call_ended(tmp_path):
    command = CommandProcess(pretended, tmp_path)
    try:
        command.begin(["code", "5"])
        assert command.wait(60.0) == 5 and command.printed() == "said\n"
        command.begin(["sleep"])
        while command.printed() != "asleep\n":
            time.sleep(0.01)
        command.send(signal.SIGINT)
        assert command.wait(20.0) == 130
        command.begin(["sleep"])
        command.send(signal.SIGKILL)
        assert command.wait(20.0) == -signal.SIGKILL
        command.begin(["code", "0"])  # a new process
        assert command.wait(60.0) == 0
    finally:
        command.kill()


def test_a_file_cannot_grow_beyond_the_disk(tmp_path):
    command = CommandProcess(writing, tmp_path)
    try:
        command.begin([str(tmp_path / "file")], disk=1000)
        assert command.wait(60.0) == 4 and os.path.getsize(tmp_path / "file") == 1000
        command.begin([str(tmp_path / "file")])
        assert command.wait(20.0) == 0 and os.path.getsize(tmp_path / "file") == 3000
    finally:
        command.kill()


def writing(arguments):
    """In place of `undertow`: 4 where the disk is full."""
    try:
        with open(arguments[0], "wb", buffering=0) as file:
            for _ in range(3):
                file.write(bytes(1000))
    except OSError:
        return 4
    return 0


class PretendedCommand:
    """A command that ends with a code when it gets a signal."""

    def __init__(self, code=130):
        self._answer, self.ended, self.signals = code, None, []

    def begin(self, arguments, disk=None):
        self.ended, self.signals = None, []

    def send(self, number):
        self.signals.append(number)
        if number not in (signal.SIGCONT, signal.SIGSTOP):
            self.ended = self._answer

    def code(self):
        return self.ended

    def wait(self, longest=0.0):
        return self.ended

    def printed(self):
        return ""

    def kill(self):
        self.ended = -9


class PretendedPeer(AbstractPeer):
    """Gives volts by the number of the call; after the end, `last`."""

    arguments = ["run", "SCENARIO"]  # noqa: RUF012 - nobody changes it

    def __init__(self, command, volts, last):
        self._command, self._volts, self._last = command, volts, last
        self.sent = []

    def begin(self, chance):
        self.sent = []

    def items(self, measured, time):
        return [measured]

    def send(self, item):
        self.sent.append(item)

    def garbage(self, like):
        return ["garbage"]

    def other_version(self, measured, time):
        return ["other version"]

    def from_another(self, measured, time):
        self.sent.append("another")

    def take(self, longest):
        time.sleep(longest)
        return np.full(8, self._volts if self._command.ended is None else self._last), 1

    def close(self):
        pass


class PretendedVehicle:
    """It stays where it is, and counts as the true one does."""

    class vehicle:
        thrusters = 8

    def restart(self):
        self.volt_seconds = self.longest_full = self.furthest = 0.0
        self.failed, self.motion = False, STILL

    def hold(self, volts, dt):
        self.longest_full += dt * bool(abs(volts).max() >= 15)
        self.volt_seconds += dt * float(abs(volts).sum())


def judged(volts=1.0, last=0.0, events=(), code=130, log=None, stops_itself=False):
    command = PretendedCommand(code)
    peer = PretendedPeer(command, volts, last)
    vehicle = PretendedVehicle()
    runner = LinkRunner(command, peer, vehicle, Path("s.yaml"), log, stops_itself)  # pyright: ignore[reportArgumentType]
    found = runner.run(Plan("links/run/1/1", events, "INT", 16, None, "seed"))
    return found, peer, command


def test_a_run_that_is_as_it_must_be():
    found, peer, _ = judged()
    assert found.failures == [] and found.code == 130 and found.neutral_after < 0.2
    assert found.volt_seconds == pytest.approx(8 * 16 * PERIOD, rel=0.3) and len(peer.sent) > 16


def test_a_vehicle_that_is_not_stopped():
    found, _, _ = judged(last=1.0)
    assert [one.event for one in found.failures] == ["N8"] and "not neutral" in found.failures[0].says


def test_full_thrust_after_one_message():
    """Of one wrong message it is a never-event, and of a stream of them it is not: that is reported."""
    found, _, _ = judged(volts=16.0, events=(Event("wild", WILD[0], 2, 1),))
    assert [one.event for one in found.failures] == ["N8"] and "full thrust for" in found.failures[0].says
    found, _, _ = judged(volts=16.0, events=(Event("replayed", "", 2, 3),))
    assert found.failures == [] and found.longest_full > 0.5


def test_a_wrong_exit_code_and_a_log_that_is_lost(tmp_path):
    found, _, _ = judged(code=3)
    assert [one.event for one in found.failures] == ["N2"]
    found, _, _ = judged(log=tmp_path / "out" / "run.mcap")
    assert [one.event for one in found.failures] == ["N9"]


@pytest.mark.parametrize("kind", STREAMS)
def test_what_a_stream_sends(kind):
    _, peer, _ = judged(events=(Event(kind, "", 8, 6),))
    others = [one for one in peer.sent if isinstance(one, str)]
    expected = {"garbage": 6, "other version": 6, "another sender": 6}
    assert len(others) == expected.get(kind, 0)


def test_a_standstill_is_a_stop_and_a_continuation():
    _, _, command = judged(events=(Event("stall", "", 3, 4),))
    assert command.signals == [signal.SIGSTOP, signal.SIGCONT, signal.SIGCONT, signal.SIGINT]


def test_a_link_whose_package_is_missing_is_left_out(tmp_path, monkeypatch):
    from soak import links_soak

    monkeypatch.setitem(links_soak._PACKAGES, "ros2", ("no_such_package",))
    found = attack_links(pretended, 1, 1, tmp_path, links=("ros2",))
    assert found.left_out == {"ros2": "no_such_package is not installed"} and found.number == 0


@pytest.mark.slow
@pytest.mark.parametrize("link", LINKS)
def test_link_commands_stop_the_vehicle(tmp_path, link):
    """Three runs of each: undisturbed, and two attacks."""
    found = attack_links(kept, 3, 20261127, tmp_path, links=(link,))
    assert found.failures == []
    assert found.number == 3 or link in found.left_out
