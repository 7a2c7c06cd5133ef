"""MAVLink over UDP as a link of the real-time loop: a companion's messages, and a watchdog at the same socket."""

from typing import Any

import numpy as np

from undertow.outside.autopilot.measured_motion import Format
from undertow.outside.mavlink.companion import Companion
from undertow.outside.mavlink.link import UdpLink
from undertow.outside.mavlink.odometry import ODOMETRIES
from undertow.outside.mavlink.permission import HEARTBEAT_TIMEOUT
from undertow.outside.realtime.link import AbstractPacingLink, LinkMeasurement
from undertow.outside.realtime.loop_clock import AbstractLoopClock, MonotonicClock
from undertow.outside.realtime.process_watchdog import Watchdog

_LAST = 3  # times that neutral commands are sent at the end: any of them may be lost
_HELD = 0.5  # s between two times that the watchdog gets what to send


class CompanionLink(AbstractPacingLink):
    """Lets a companion talk through a socket. What is sent last are neutral commands, however it ends.

    A `Watchdog` sends them where this process is killed, or stands still for too long.

    The vehicle is where the first message of the target comes from. With `udpin`, another sender takes its place after
    3 s without one. Of odometries that have queued up, the newest counts. After a standstill of this process nothing
    counts that came meanwhile.

    Args:
        companion: its rules.
        link: to the vehicle.
        clock: of the loop.
    """

    def __init__(self, companion: Companion, link: UdpLink, clock: AbstractLoopClock | None = None):
        self.form = Format("quaternion", "body")
        self._companion = companion
        self._link = link
        self._clock = clock or MonotonicClock()
        self._messages: list[tuple[Any, Any]] = []  # that have come and were not looked at, with their senders
        self._talked = self._held = -np.inf  # s, last message of the target; last words to the watchdog
        self._answered = 0  # stamp of the measurement that the next command answers, ns
        self._begun, self._superseded = False, 0
        self._watchdog: Watchdog | None = None

    def guard(self, safe: np.ndarray, longest: float) -> None:
        self._watchdog = Watchdog(self._link.socket, longest)

    def wait(self, longest: float) -> None:
        if self._watchdog is not None:
            self._watchdog.alive()
        self._link.send(self._companion.due(self._clock.now()))
        self._messages += self._link.receive(longest)

    def discard(self) -> None:
        self._messages.clear()
        self._link.drain()
        self._link.codec.overtake()

    def receive(self, elapsed: float) -> LinkMeasurement | None:
        now = self._clock.now()
        newest = None
        welcome = [message for message, sender in self._messages if self._is_welcome(message, sender, now)]
        self._messages.clear()
        for message in self._without_superseded(welcome):
            measurement = self._companion.receive(message, now)
            newest = newest if measurement is None else measurement
        if newest is not None:
            self._answered = newest.stamp
        return newest

    def objection(self) -> str:
        return self._companion.objection(self._clock.now())

    def note_begin(self) -> None:
        self._begun = True
        self._companion.note_begin()

    def send(self, command: np.ndarray) -> None:
        self._hold_if_due()  # before the first command, too
        self._link.send(self._companion.commands(command, self._answered))
        self._answered = 0

    def finish(self, safe: np.ndarray) -> None:
        for _ in range(_LAST if self._begun else 0):
            self._link.send(self._companion.neutral())
        if self._watchdog is not None:
            self._watchdog.done()

    def counts(self) -> dict[str, int]:
        counts = self._companion.counts | {"superseded": self._superseded, "unsent": self._link.unsent}
        return counts | self._link.codec.counts

    def complaints(self) -> list[str]:
        return self._companion.complaints()

    def _hold_if_due(self) -> None:
        """Give the watchdog what stops the vehicle."""
        now = self._clock.now()
        if self._watchdog is not None and self._link.peer and now - self._held > _HELD:
            self._watchdog.hold(self._link.peer, self._link.codec.packed_ahead(self._companion.neutral()))
            self._held = now

    def _is_welcome(self, message: Any, sender: Any, now: float) -> bool:
        """False for a message of the target from another address than that of the vehicle, which talks."""
        if not self._companion.is_from_target(message):
            return True
        if self._link.peer is not None and sender != self._link.peer and now - self._talked < HEARTBEAT_TIMEOUT:
            return False
        self._link.peer, self._talked = sender, now
        return True

    def _without_superseded(self, messages: list[Any]) -> list[Any]:
        """Messages without the odometries of the vehicle after which a newer one has come."""
        last = {message.get_type(): message for message in messages if self._companion.is_from_target(message)}
        old = lambda message: message.get_type() in ODOMETRIES and message is not last[message.get_type()]
        current = [message for message in messages if not (self._companion.is_from_target(message) and old(message))]
        self._superseded += len(messages) - len(current)
        return current
