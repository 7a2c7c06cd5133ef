"""One run of a link command: the vehicle in real time, what its plan says, and the verdict."""

import random
import shutil
import signal
import time
from collections import deque
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from soak.links.command_process import CommandProcess
from soak.links.driven_vehicle import DrivenVehicle
from soak.links.peer import AbstractPeer, Measured, altered, measured_of
from soak.links.plan import CODES, STATED, Event, Plan, signals_of
from soak.links.scenario import MAX_AGE, PERIOD
from soak.verdict import Failure
from undertow.logs.read import read_log
from undertow.outside.ros2.read_bag import read_rosbag2

_BEGINS = 600.0  # s, longest wait for the first command: the law is compiled before
_WATCHED = 1.5  # s after the stated time for which the vehicle must stay stopped
_TRANSIENT = 0.5  # s of full thrust that one message or signal may cause
_LONGEST = 0.2  # s by which the vehicle moves in a step, should this process stand still itself
_LOST = 10  # steps that a log may lack, which is a second


class LinkRun(NamedTuple):
    """Result of a run.

    Attributes:
        plan: what happened.
        volt_seconds: that the thrusters got, V s.
        longest_full: longest time of full thrust, s.
        furthest: m from the start.
        neutral_after: s from the ending to the first neutral command after the last other one.
        code: exit code.
        failures: never-events.
    """

    plan: Plan
    volt_seconds: float
    longest_full: float
    furthest: float
    neutral_after: float
    code: int | None
    failures: list[Failure]


class LinkRunner:
    """Runs plans of one link.

    Args:
        command: process in which the command runs.
        peer: the vehicle's side of the link.
        vehicle: behind it.
        scenario: file.
        log: that the command writes; None where it writes none.
        stops_itself: whether the vehicle stops its thrusters without commands, because nobody else can: in ROS 2.
    """

    def __init__(
        self,
        command: CommandProcess,
        peer: AbstractPeer,
        vehicle: DrivenVehicle,
        scenario: Path,
        log: Path | None,
        stops_itself: bool,
    ):
        self._command, self._peer, self._vehicle, self._log = command, peer, vehicle, log
        self._arguments = [str(scenario) if word == "SCENARIO" else word for word in peer.arguments]
        self._stops_itself = stops_itself

    def run(self, plan: Plan) -> LinkRun:
        """What happens by a plan."""
        self._plan = plan
        self._chance = random.Random(plan.seed)
        self._vehicle.restart()
        self._volts = np.zeros(self._vehicle.vehicle.thrusters)
        self._commands = 0
        self._thrusts = 0
        self._commanded_at = self._thrust_at = time.monotonic()
        self._sent: deque[Any] = deque(maxlen=100)
        self._held_back: list[Any] = []
        self._step = 0
        self._began = time.monotonic()
        self._due = self._moved_at = self._began
        if self._log is not None:
            shutil.rmtree(self._log if self._log.suffix == "" else self._log.parent, ignore_errors=True)
        self._peer.begin(self._chance)
        self._command.begin(self._arguments, plan.disk)
        if not self._control_begins():
            message = f"control did not begin: exit code {self._command.code()}. {_last(self._command.printed())}"
            self._code = self._command.code()
            self._command.kill()
            return self._result(0.0, [("N3", message)])
        while self._step < plan.last:
            for event in plan.events:
                if event.kind == "stall" and event.first == self._step:
                    self._command.send(signal.SIGSTOP)
                if event.kind == "stall" and event.first + event.steps == self._step:
                    self._command.send(signal.SIGCONT)
            self._take_step(True)
        self._command.send(signal.SIGCONT)
        ended_at = self._end()
        return self._result(self._thrust_at - ended_at, self._events(ended_at))

    def _control_begins(self) -> bool:
        """Whether a command comes that is not neutral; the vehicle stands still until then."""
        until = time.monotonic() + _BEGINS
        while time.monotonic() < until and self._command.code() is None:
            for item in self._peer.items(measured_of(self._vehicle.motion), self._time()):
                self._peer.send(item)
            self._due = time.monotonic() + PERIOD
            self._receive()
            self._step += 1
            if self._thrusts:
                self._step = 0
                self._moved_at = time.monotonic()
                return True
        return False

    def _time(self) -> float:
        """Of the vehicle's clock, s."""
        return time.monotonic() - self._began

    def _take_step(self, talking: bool) -> None:
        """Say where the vehicle is, take commands for a sampling time, and move."""
        if talking:
            self._talk(measured_of(self._vehicle.motion))
        self._due = max(self._due + PERIOD, time.monotonic())
        self._receive()
        silent = time.monotonic() - self._commanded_at > MAX_AGE
        before = self._moved_at
        self._moved_at = time.monotonic()
        volts = 0.0 * self._volts if self._stops_itself and silent else self._volts
        self._vehicle.hold(volts, min(self._moved_at - before, _LONGEST))
        self._step += 1

    def _receive(self) -> None:
        """Take the commands that come until the next step is due."""
        while (left := self._due - time.monotonic()) > 0:
            volts, count = self._peer.take(left)
            self._commands += count
            if volts is not None:
                self._volts = volts
                self._commanded_at = time.monotonic()
                if volts.any():
                    self._thrusts += 1
                    self._thrust_at = self._commanded_at

    def _talk(self, measured: Measured) -> None:
        now = [event for event in self._plan.events if event.covers(self._step)]
        for event in now:
            if event.kind == "wild":
                measured = altered(measured, event.what)
        clock = self._time() + (3600.0 if any(event.kind == "clock set" for event in now) else 0.0)
        items = self._peer.items(measured, clock)
        for event in now:
            items = self._attacked(event, items, measured)
        if not any(event.kind in ("reordered", "late") for event in now) and self._held_back:
            items = self._held_back + items
            self._held_back = []
        for item in items:
            self._peer.send(item)
            self._sent.append(item)

    def _attacked(self, event: Event, items: list[Any], measured: Measured) -> list[Any]:
        """Items that are sent in place of those of this step."""
        if event.kind == "silence":
            return []
        if event.kind == "late":
            self._held_back += items
            return []
        if event.kind == "reordered":
            self._held_back += items
            if len(self._held_back) < 4:
                return []
            released = self._held_back
            self._held_back = []
            self._chance.shuffle(released)
            return released
        if event.kind == "replayed":
            return items + self._chance.choices(list(self._sent), k=3)
        if event.kind == "old only":
            return self._chance.choices(list(self._sent))
        if event.kind == "garbage":
            return items + self._peer.garbage(items[-1])
        if event.kind == "other version":
            return items + self._peer.other_version(measured, self._time())
        if event.kind == "another sender":
            self._peer.from_another(measured._replace(position=measured.position + 20.0), self._time())
        return items

    def _end(self) -> float:
        """End the command as the plan says, and watch; when that was."""
        ending = self._plan.ending
        numbers = signals_of(self._plan.ending)
        ended_at = time.monotonic()
        for number in numbers:
            self._command.send(number)
            time.sleep(0.02 if len(numbers) > 1 else 0.0)
        stated = STATED.get(ending, 1.0)
        while time.monotonic() < ended_at + stated + _WATCHED:
            self._take_step(ending != "silence")
        if ending == "stop":
            self._command.send(signal.SIGKILL)
        if ending == "silence":
            self._command.send(signal.SIGTERM)
        self._code = self._command.wait()
        if self._code is None:
            self._command.kill()
        return ended_at

    def _events(self, ended_at: float) -> list[tuple[str, str]]:
        plan = self._plan
        events = []
        after = self._thrust_at - ended_at
        stated = STATED.get(plan.ending, 1.0)
        stopped = not self._volts.any() or (self._stops_itself and time.monotonic() - self._commanded_at > MAX_AGE)
        if not stopped:
            events.append(("N8", f"the last command is not neutral, {after:.2f} s after the end"))
        elif after > stated:
            events.append(("N8", f"the last command that is not neutral came {after:.2f} s after the end"))
        if plan.is_single and self._vehicle.longest_full > _TRANSIENT + 1e-9:
            events.append(("N8", f"full thrust for {self._vehicle.longest_full:.2f} s"))
        if self._vehicle.failed:
            events.append(("N1", "the vehicle's state is not finite"))
        printed = self._command.printed()
        if self._code is None:
            events.append(("N3", "the command did not end within ten seconds"))
        elif self._code not in self._codes() or "Traceback" in printed:
            events.append(("N2", f"exit code {self._code}: {_last(printed)}"))
        return events + self._of_log()

    def _codes(self) -> tuple[int, ...]:
        """Exit codes that are right: a loop that stood still or got nothing may have ended by itself before."""
        full = () if self._plan.disk is None else (4,)
        if self._plan.ending in ("KILL", "stop"):
            return (-int(signal.SIGKILL), 1, *full)
        return (*CODES[self._plan.ending], 1, *full)

    def _of_log(self) -> list[tuple[str, str]]:
        """A log has every step but those of the last second, and can be read as far as the disk took it."""
        if self._log is None:
            return []
        try:
            rows = _rows(self._log)
        except Exception as error:
            if self._plan.disk is not None and self._plan.disk < 20_000:
                return []  # not even the beginning found room
            return [("N9", f"the log cannot be read: {error}")]
        if self._plan.disk is None and rows < self._thrusts - _LOST:
            return [("N9", f"the log has {rows} steps, and {self._thrusts} commands came")]
        return []

    def _result(self, after: float, events: list[tuple[str, str]]) -> LinkRun:
        vehicle = self._vehicle
        failures = [Failure(event, self._plan.identity, f"{message} ({self._plan})") for event, message in events]
        measures = vehicle.volt_seconds, vehicle.longest_full, vehicle.furthest
        return LinkRun(self._plan, *measures, max(0.0, after), self._code, failures)


def _rows(path: Path) -> int:
    """Steps in a log: rows of run.mcap, or commands in a bag."""
    if path.is_dir():
        return len(read_rosbag2(path, ["/thrusters"])["/thrusters"][0])

    return len(read_log(path)["commanded_input"].time)


def _last(text: str) -> str:
    lines = text.strip().splitlines()
    return lines[-1][:300] if lines else "nothing printed"
