"""The loop that lets a companion talk through a link."""

import time
from collections.abc import Callable
from typing import Any

from undertow.interop.latency import Latency
from undertow.interop.mavlink.companion import Companion
from undertow.interop.mavlink.link import UdpLink
from undertow.interop.mavlink.odometry import ODOMETRIES
from undertow.interop.mavlink.permission import HEARTBEAT_TIMEOUT
from undertow.realtime.watchdog import Watchdog

_LOOK = 0.05  # s, longest wait before what is due is sent
_LAST = 3  # times that neutral commands are sent at the end: any of them may be lost
_HELD = 0.5  # s between two times that the watchdog gets what to send


class CompanionLoop:
    """Lets a companion talk through a link. What is sent last are neutral commands, however it ends.

    A `Watchdog` sends them where this process is killed, or stands still for longer than the companion's timeout.

    The vehicle is where the first message of the target comes from. With `udpin`, another sender takes its place after
    3 s without one. Of odometries that have queued up, the newest counts. After a standstill of this process nothing
    counts that came meanwhile.

    Args:
        companion: rules, with the law.
        link: to the vehicle.
        report: gets a line about the link.
        every: s between these lines.
        latency: gets the time from each odometry to the commands.
    """

    def __init__(
        self,
        companion: Companion,
        link: UdpLink,
        report: Callable[[str], None] = lambda line: None,
        every: float = 1.0,
        latency: Latency | None = None,
    ):
        self._companion, self._link = companion, link
        self._report, self._every, self._latency = report, every, latency or Latency()
        self._received = self._held = -float("inf")  # s, last message of the target; last words to the watchdog
        self._looked = self._due = 0.0  # s, when messages were looked for; of the next line
        self._steps = 0  # at the last line

    def run(self, until: Callable[[], bool] = lambda: False) -> None:
        """Talk until a function says so, which is asked twenty times a second, or Ctrl-C."""
        self._looked = time.monotonic()
        self._due = self._looked + self._every
        watchdog = Watchdog(self._link.socket, self._companion.timeout)
        try:
            while not until():
                self._answer_all(self._of_the_present(), watchdog)
                self._link.send(self._companion.idle(time.monotonic()))
                watchdog.alive()
                self._report_if_due()
        finally:
            for _ in range(_LAST):
                self._link.send(self._companion.neutral())
            watchdog.done()

    def _of_the_present(self) -> list[tuple[Any, Any]]:
        """Messages that have come, with their senders; none where this process stood still."""
        messages = self._link.receive(max(0.001, min(_LOOK, self._due - time.monotonic())))
        now = time.monotonic()
        stood_still = now - self._looked > _LOOK + self._companion.timeout
        self._looked = now
        if stood_still:
            self._link.drain()
            self._link.codec.overtake()
            return []
        return messages

    def _answer_all(self, messages: list[tuple[Any, Any]], watchdog: Watchdog) -> None:
        begun, now = time.perf_counter(), time.monotonic()
        arrived = [message for message, sender in messages if self._is_welcome(message, sender, now)]
        for message in _newest(arrived, self._companion):
            before = self._companion.counts["steps"]
            answer = self._companion.receive(message, now)
            self._hold_if_due(watchdog, now)  # before the first command, too
            self._link.send(answer)
            if self._companion.counts["steps"] > before:
                self._latency.add(time.perf_counter() - begun)

    def _hold_if_due(self, watchdog: Watchdog, now: float) -> None:
        """Give the watchdog what stops the vehicle, while the law runs."""
        if self._companion.running and self._link.peer and now - self._held > _HELD:
            watchdog.hold(self._link.peer, self._link.codec.packed_ahead(self._companion.neutral()))
            self._held = now

    def _is_welcome(self, message: Any, sender: Any, now: float) -> bool:
        """False for a message of the target from another address than that of the vehicle, which talks."""
        if not self._companion.is_from_target(message):
            return True
        if self._link.peer is not None and sender != self._link.peer and now - self._received < HEARTBEAT_TIMEOUT:
            return False
        self._link.peer, self._received = sender, now
        return True

    def _report_if_due(self) -> None:
        if time.monotonic() < self._due:
            return
        steps = self._companion.counts["steps"]
        self._report(self._status_line((steps - self._steps) / self._every))
        self._steps, self._due = steps, time.monotonic() + self._every

    def _status_line(self, rate: float) -> str:
        """What is going on; `rate` is that of the steps, Hz."""
        timing = self._companion.steps_counted
        counts = self._companion.counts | {"late": timing["late"], "missed": timing["missed"]}
        counts |= {"unsent": self._link.unsent} | self._link.codec.counts
        parts = [self._companion.state(time.monotonic()), f"{rate:.0f} Hz", f"step {self._latency}"]
        parts += [f"{name} {number}" for name, number in counts.items() if number and name != "steps"]
        return "; ".join([*parts, *self._companion.complaints()])


def _newest(messages: list[Any], companion: Companion) -> list[Any]:
    """Messages without the odometries of the vehicle after which a newer one has come."""
    last = {message.get_type(): message for message in messages if companion.is_from_target(message)}
    old = lambda message: message.get_type() in ODOMETRIES and message is not last[message.get_type()]
    found = [message for message in messages if not (companion.is_from_target(message) and old(message))]
    companion.counts["superseded"] += len(messages) - len(found)
    return found
