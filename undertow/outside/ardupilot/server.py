"""The UDP socket of the JSON simulator: it waits for ArduPilot's packets and answers them."""

import contextlib
import socket
import time
from collections.abc import Callable, Iterator

from undertow.core.errors import BadInput
from undertow.outside.ardupilot.session import Session
from undertow.outside.realtime.loop_statistics import Durations

PORT = 9002  # to which ArduPilot sends; 10 more for each further instance (-I1 sends to 9012)

_LONGEST = 2048  # bytes of a datagram that are read; a packet has 72 at most
_AT_ONCE = 64  # waiting datagrams that one reply answers
_LITTLE = 1e-9  # s, rounding of the time


def listen(address: str = "127.0.0.1", port: int = PORT) -> socket.socket:
    """A socket that ArduPilot can send to.

    Args:
        address: of this machine; 0.0.0.0 for all its addresses.
        port: 0 for any that is free.

    Raises:
        BadInput: the port is taken, or there is no such address.
    """
    if not 0 <= port <= 65535:
        raise BadInput("port", "be from 0 to 65535", port)
    link = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    try:
        link.bind((address, port))
    except OSError as error:
        link.close()
        hint = "Another simulator may be running; SITL's option -I1 sends to 9012"
        raise BadInput("port", "be free to listen on", f"{address}:{port}: {error.strerror}", hint=hint) from None
    return link


def serve(
    session: Session,
    link: socket.socket,
    report: Callable[[str], None] = lambda line: None,
    duration: float = float("inf"),
    every: float = 1.0,
    latency: Durations | None = None,
) -> None:
    """Answer packets until the vehicle cannot go on, its time is up, or Ctrl-C.

    Nothing is sent at the end: ArduPilot waits for its reply, sends its packet again once per second, and goes on when
    the physics is there again.

    Args:
        session: rules, with the vehicle.
        link: from `listen`.
        report: gets a line about the link.
        duration: time of the physics, s.
        every: s between these lines.
        latency: gets the time from each packet to its reply.
    """
    measured = latency or Durations()
    due = time.monotonic() + every
    while not session.ended and session.vehicle.time < duration - _LITTLE:
        newest_reply, arrival = None, 0.0
        for datagram, sender in _arriving(link, due):
            arrival = arrival or time.perf_counter()
            newest_reply = session.answer(datagram, sender, time.monotonic()) or newest_reply
            if newest_reply is not None and session.vehicle.time >= duration - _LITTLE:
                break
        if newest_reply is not None:
            with contextlib.suppress(OSError):  # the network is down: ArduPilot sends its packet again
                link.sendto(newest_reply, session.sender)
            measured.add(time.perf_counter() - arrival)
        if time.monotonic() >= due:
            report(status_line(session, measured))
            due = time.monotonic() + every


def status_line(session: Session, latency: Durations) -> str:
    """What is going on, in one line."""
    if session.sender is None:
        complaint = f"; {session.counts['invalid']} other packets: {session.complaint}" if session.complaint else ""
        return f"waiting for ArduPilot{complaint}"
    north, east, down = session.vehicle.state().position
    parts = [
        f"{session.vehicle.time:.1f} s",
        f"{session.frame_rate} Hz",
        f"north {north:.2f} m, east {east:.2f} m, down {down:.2f} m",
        f"reply {latency}",
        *(f"{name} {number}" for name, number in session.counts.items() if number and name != "frames"),
    ]
    if session.undriven:
        parts.append(f"thrusters without signal {session.undriven}")
    return "; ".join(parts)


def _arriving(link: socket.socket, due: float) -> Iterator[tuple[bytes, tuple[str, int]]]:
    """Datagrams that wait, after the first one; nothing where none comes before `due`.

    ArduPilot takes any reply for the one to its last packet. Copies of a packet that arrived while the physics was
    busy must therefore not be answered twice.
    """
    link.settimeout(max(0.001, due - time.monotonic()))
    try:
        datagram, sender = link.recvfrom(_LONGEST)
    except TimeoutError:
        return
    yield datagram, sender
    link.setblocking(False)
    for _ in range(_AT_ONCE):
        try:
            datagram, sender = link.recvfrom(_LONGEST)
        except BlockingIOError:
            return
        yield datagram, sender
