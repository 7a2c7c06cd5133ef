"""One run of `undertow ardupilot`: an autopilot in lock step that drives gently, and what happens on its link."""

import json
import random
import signal
import socket
import struct
import time
from pathlib import Path
from typing import Any

import numpy as np

from soak.links.command_process import CommandProcess
from soak.links.link_run import LinkRun
from soak.links.peer import damaged
from soak.links.plan import CODES, STATED, Plan, free_port, signals_of
from soak.links.scenario import PERIOD
from soak.verdict import Failure

_RATE = round(1 / PERIOD)  # Hz
_MAGIC = 18458  # of packets with 16 channels
_BEGINS = 600.0  # s
_AGAIN = 0.5  # s after which the packet is sent again
_LONGEST = 65535  # bytes
_OLD, _OLD_KINDS = "old", ("replayed", "reordered", "old only", "late")
_DAMAGED = ("garbage", "other version", "wild")


class ArdupilotRunner:
    """Runs plans. The command is the physics here: what must hold is that its answers are finite and its time goes on.

    Args:
        command: process in which the command runs.
        scenario: file.
    """

    def __init__(self, command: CommandProcess, scenario: Path):
        self._command, self._scenario = command, scenario

    def run(self, plan: Plan) -> LinkRun:
        """What happens by a plan."""
        self._chance = random.Random(plan.seed)
        self._plan = plan
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as vehicle_socket:
            port = free_port()
            self._address = ("127.0.0.1", port)
            self._socket = vehicle_socket
            self._command.begin(["ardupilot", str(self._scenario), "--port", str(port)], plan.disk)
            failures = self._talk() if self._begins() else [("N3", "the physics did not begin")]
            ended_at = time.monotonic()
            failures += self._end()
        never_events = [Failure(event, plan.identity, f"{message} ({plan})") for event, message in failures]
        return LinkRun(plan, 0.0, 0.0, 0.0, max(0.0, self._ended_at - ended_at), self._code, never_events)

    def _begins(self) -> bool:
        until = time.monotonic() + _BEGINS
        while time.monotonic() < until and self._command.code() is None:
            if self._exchange(self._packet(0), 0.2) is not None:
                return True
        return False

    def _talk(self) -> list[tuple[str, str]]:
        """Frames until the end of the plan; never-events."""
        failures: list[tuple[str, str]] = []
        sent = [self._packet(0)]
        before = 0.0
        for step in range(1, self._plan.last):
            frame_start = time.monotonic()
            packet = self._packet(step)
            now = [event for event in self._plan.events if event.covers(step)]
            for kind in sorted({_OLD if event.kind in _OLD_KINDS else event.kind for event in now}):
                self._disturb(kind, any(event.first == step for event in now), packet, sent)
            answer = self._patiently(packet, before)
            if answer is None:
                return (
                    failures if self._command.code() is not None else [*failures, ("N3", f"no answer to frame {step}")]
                )
            numbers = np.hstack([np.ravel(value) for value in _numbers(answer)])
            if not np.isfinite(numbers).all():
                failures.append(("N1", f"an answer with numbers that are not finite at frame {step}"))
            if answer["timestamp"] < before:
                failures.append(("N8", f"the time went from {before:g} to {answer['timestamp']:g} s at frame {step}"))
            before = answer["timestamp"]
            sent.append(packet)
            time.sleep(max(0.0, frame_start + PERIOD - time.monotonic()))
        return failures

    def _disturb(self, kind: str, first: bool, packet: bytes, sent: list[bytes]) -> None:
        """What comes beside the packet of a frame."""
        send = lambda data: self._socket.sendto(data, self._address)
        if kind == "stall" and first:
            self._command.send(signal.SIGSTOP)
            time.sleep(PERIOD * self._chance.choice((1, 3, 15)))
            self._command.send(signal.SIGCONT)
        elif kind in _DAMAGED:
            for data in damaged(packet, self._chance):
                if data[:2] != packet[:2] or len(data) != len(packet):  # the protocol has no checksum
                    send(data)
        elif kind == _OLD:  # one at a time: two old ones in a row are a restart, as the protocol has no session
            send(self._chance.choice(sent))
        elif kind == "another sender":
            with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as foreign_socket:
                foreign_socket.sendto(self._packet(self._chance.randrange(1, 2**31)), self._address)
        elif kind == "silence" and first:
            time.sleep(1.0)

    def _patiently(self, packet: bytes, before: float) -> Any:
        """The answer to a packet, which is sent again as ArduPilot does.

        An old packet is answered by the last answer again. Where that comes first, the new one is waited for.
        """
        for _ in range(20):
            answer = self._exchange(packet, _AGAIN)
            if answer is not None and answer["timestamp"] != before:
                return answer
            if self._command.code() is not None:
                break
        return None

    def _exchange(self, packet: bytes, longest: float) -> Any:
        """The newest answer that is there after one has come; None without any within so many seconds."""
        newest = b""
        self._socket.settimeout(longest)
        try:
            self._socket.sendto(packet, self._address)
            newest = self._socket.recv(_LONGEST)
            self._socket.settimeout(0.0)
            while True:
                newest = self._socket.recv(_LONGEST)
        except OSError:  # nothing, or nothing more, or nobody listens
            return json.loads(newest) if newest else None

    def _packet(self, step: int) -> bytes:
        pulses = [round(1500 + 40 * np.sin(0.1 * step + k)) for k in range(8)]
        return struct.pack("<HHI16H", _MAGIC, _RATE, step, *pulses, *8 * [0])

    def _end(self) -> list[tuple[str, str]]:
        """End the command as the plan says; never-events."""
        ending = self._plan.ending
        for number in signals_of(ending):
            self._command.send(number)
            time.sleep(0.02)
        if ending in ("stop", "silence"):
            time.sleep(STATED[ending])
            self._command.send(signal.SIGKILL if ending == "stop" else signal.SIGTERM)
        self._code = self._command.wait()
        self._ended_at = time.monotonic()
        printed = self._command.printed()
        if self._code is None:
            self._command.kill()
            return [("N3", "the command did not end within ten seconds")]
        right = (-int(signal.SIGKILL),) if ending in ("KILL", "stop") else CODES[ending]
        if self._code not in right or "Traceback" in printed:
            return [("N2", f"exit code {self._code}: {printed.strip()[-300:]}")]
        return []


def _numbers(answer: Any) -> list[Any]:
    imu = answer["imu"]
    return [answer["timestamp"], imu["gyro"], imu["accel_body"], answer["position"], answer["quaternion"]]
