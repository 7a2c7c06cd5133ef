"""The UDP socket of a companion, and the loop that serves it."""

import socket
import time
from collections.abc import Callable
from typing import Any

from pymavlink.dialects.v20 import common as mavlink

from undertow.core.errors import BadInput
from undertow.interop.latency import Latency
from undertow.interop.mavlink.companion import Companion
from undertow.interop.mavlink.odometry import ODOMETRIES
from undertow.interop.mavlink.permission import HEARTBEAT_TIMEOUT
from undertow.realtime.watchdog import Watchdog

_LONGEST = 65535  # bytes of a datagram
_LOOK = 0.05  # s, longest wait before what is due is sent
_AT_ONCE = 256  # datagrams that are read at once
_LAST = 3  # times that neutral commands are sent at the end: any of them may be lost
_HELD = 0.5  # s between two times that the watchdog gets what to send
_KINDS = ("udp", "udpin", "udpout")


class UdpLink:
    """Sends and receives MAVLink 2 over UDP. Datagrams hold whole messages, as those of autopilots and routers do.

    Args:
        place: `udpin:HOST:PORT` (or `udp:...`) listens there, and answers to where the vehicle's messages come from;
            `udpout:HOST:PORT` sends there.
        system, component: our ids.

    Attributes:
        socket: that it uses.
        port: on which it listens.
        peer: address of the vehicle; None before it is known.
        unsent: messages that the network did not take, such as while a cable is unplugged. They are lost.

    Raises:
        BadInput: the place is none, or the port is taken.
    """

    def __init__(self, place: str, system: int = 255, component: int = mavlink.MAV_COMP_ID_ONBOARD_COMPUTER):
        kind, address = _parsed(place)
        for name, number in (("system", system), ("component", component)):
            if not 1 <= number <= 255:
                raise BadInput(name, "be from 1 to 255", number)
        self._packer: Any = mavlink.MAVLink(None, srcSystem=system, srcComponent=component)
        self.socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self.peer: Any = None
        self.unsent, self._fixed = 0, kind == "udpout"
        try:
            if kind == "udpout":
                self.peer = socket.gethostbyname(address[0]), address[1]
                self.socket.bind(("", 0))
            else:
                self.socket.bind(address)
        except OSError as error:
            self.socket.close()
            hint = "Another program may be listening there"
            raise BadInput("connect", "be free to use", f"{place}: {error.strerror}", hint=hint) from None
        self.port = self.socket.getsockname()[1]

    def __enter__(self) -> "UdpLink":
        return self

    def __exit__(self, *error: Any) -> None:
        self.socket.close()

    def receive(self, longest: float) -> list[tuple[Any, Any]]:
        """Messages of all datagrams that are there, each with its sender; it waits for one, at most `longest`, s.

        With `udpout` only those of the vehicle.
        """
        found: list[tuple[Any, Any]] = []
        for k in range(_AT_ONCE):
            self.socket.settimeout(0.0 if k else longest)
            try:
                data, sender = self.socket.recvfrom(_LONGEST)
            except OSError:  # nothing there, or nobody listens on the other side
                break
            if not self._fixed or sender == self.peer:
                found += [(message, sender) for message in parsed(data)]
        return found

    def drain(self) -> None:
        """Forget what has come so far: it is old."""
        for _ in range(_AT_ONCE):
            if not self.receive(0.0):
                break

    def send(self, messages: list[Any]) -> None:
        """Send messages to the vehicle, if its address is known."""
        if self.peer is None:
            return
        for data in self.packed(messages):
            try:
                self.socket.sendto(data, self.peer)
            except OSError:  # the vehicle notices that commands are missing, and the next one may get through
                self.unsent += 1

    def packed(self, messages: list[Any]) -> list[bytes]:
        """Messages as datagrams, numbered on."""
        found = []
        for message in messages:
            found.append(message.pack(self._packer))
            self._packer.seq = (self._packer.seq + 1) % 256
        return found


def parsed(data: bytes) -> list[Any]:
    """Messages in the bytes of a datagram; what is none is left out, and so are those of an unknown kind.

    Without knowing the kind, pymavlink cannot check the sum of a message: random bytes pass as one.
    """
    parser: Any = mavlink.MAVLink(None)
    parser.robust_parsing = True
    found = parser.parse_buffer(data) or []
    return [one for one in found if not isinstance(one, mavlink.MAVLink_bad_data | mavlink.MAVLink_unknown)]


def accompany(
    companion: Companion,
    link: UdpLink,
    report: Callable[[str], None] = lambda line: None,
    until: Callable[[], bool] = lambda: False,
    every: float = 1.0,
    latency: Latency | None = None,
) -> None:
    """Let a companion talk through a link until it is to end, or Ctrl-C. What is sent last are neutral commands.

    A `Watchdog` sends them where this process is killed, or stands still for longer than the companion's timeout.

    The vehicle is where the first message of the target comes from. With `udpin`, another sender takes its place after
    3 s without one. Of odometries that have queued up, the newest counts. After a standstill of this process nothing
    counts that came meanwhile.

    Args:
        companion: rules, with the law.
        link: to the vehicle.
        report: gets a line about the link.
        until: whether to end; asked twenty times a second.
        every: s between these lines.
        latency: gets the time from each odometry to the commands.
    """
    measured = latency or Latency()
    due, received, steps, held = time.monotonic() + every, -float("inf"), 0, -float("inf")
    watchdog, looked = Watchdog(link.socket, companion.timeout), time.monotonic()
    try:
        while not until():
            messages = link.receive(max(0.001, min(_LOOK, due - time.monotonic())))
            begun, now = time.perf_counter(), time.monotonic()
            if now - looked > _LOOK + companion.timeout:
                link.drain()
                messages = []
            looked = now
            arrived = []
            for message, sender in messages:
                if companion.is_from_target(message):
                    if link.peer is not None and sender != link.peer and now - received < HEARTBEAT_TIMEOUT:
                        continue
                    link.peer, received = sender, now
                arrived.append(message)
            for message in _newest(arrived, companion):
                before = companion.counts["steps"]
                answer = companion.receive(message, now)
                if companion.running and link.peer and now - held > _HELD:  # before the first command, too
                    watchdog.hold(link.peer, link.packed(companion.neutral()))
                    held = now
                link.send(answer)
                if companion.counts["steps"] > before:
                    measured.add(time.perf_counter() - begun)
            link.send(companion.idle(time.monotonic()))
            watchdog.alive()
            if time.monotonic() >= due:
                report(status_line(companion, link, measured, (companion.counts["steps"] - steps) / every))
                steps, due = companion.counts["steps"], time.monotonic() + every
    finally:
        for _ in range(_LAST):
            link.send(companion.neutral())
        watchdog.done()


def _newest(messages: list[Any], companion: Companion) -> list[Any]:
    """Messages without the odometries of the vehicle after which a newer one has come."""
    last = {message.get_type(): message for message in messages if companion.is_from_target(message)}
    old = lambda message: message.get_type() in ODOMETRIES and message is not last[message.get_type()]
    found = [message for message in messages if not (companion.is_from_target(message) and old(message))]
    companion.counts["superseded"] += len(messages) - len(found)
    return found


def status_line(companion: Companion, link: UdpLink, latency: Latency, rate: float) -> str:
    """What is going on, in one line; `rate` is that of the steps, Hz."""
    timing = companion.steps_counted
    counts = companion.counts | {"late": timing["late"], "missed": timing["missed"], "unsent": link.unsent}
    parts = [companion.state(time.monotonic()), f"{rate:.0f} Hz", f"step {latency}"]
    parts += [f"{name} {number}" for name, number in counts.items() if number and name != "steps"]
    return "; ".join([*parts, companion.complaint] if companion.complaint else parts)


def _parsed(place: str) -> tuple[str, tuple[str, int]]:
    """Kind and address of `udpin:HOST:PORT`."""
    kind, _, rest = place.partition(":")
    host, _, port = rest.rpartition(":")
    lowest = 1 if kind == "udpout" else 0  # of which a listener gets any that is free
    if kind not in _KINDS or not host or not port.isdecimal() or not lowest <= int(port) <= 65535:
        hint = "For a serial line, start a router such as mavlink-router or MAVProxy"
        raise BadInput("connect", "be udpin:HOST:PORT or udpout:HOST:PORT", place, hint=hint)
    return kind, (host, int(port))
