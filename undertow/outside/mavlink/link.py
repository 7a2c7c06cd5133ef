"""The UDP socket of a companion."""

import socket
from typing import Any

from pymavlink.dialects.v20 import common as mavlink

from undertow.core.errors import BadInput
from undertow.outside.mavlink.message_codec import MessageCodec

_LONGEST = 65535  # bytes of a datagram
_AT_ONCE = 256  # datagrams that are read at once
_KINDS = ("udp", "udpin", "udpout")


class UdpLink:
    """Sends and receives MAVLink 2 over UDP. Datagrams hold whole messages, as those of autopilots and routers do.

    Args:
        endpoint: `udpin:HOST:PORT` (or `udp:...`) listens there, and answers to where the vehicle's messages come from;
            `udpout:HOST:PORT` sends there.
        system, component: our ids.
        key: 32 bytes with which messages are signed, and those of the vehicle must be; None for no signatures.

    Attributes:
        socket: that it uses.
        codec: of the messages, which counts what it refuses.
        port: on which it listens.
        peer: address of the vehicle; None before it is known.
        unsent: messages that the network did not take, such as while a cable is unplugged. They are lost.

    Raises:
        BadInput: the place is none, or the port is taken.
    """

    def __init__(
        self,
        endpoint: str,
        system: int = 255,
        component: int = mavlink.MAV_COMP_ID_ONBOARD_COMPUTER,
        key: bytes | None = None,
    ):
        kind, address = _parsed(endpoint)
        for name, number in (("system", system), ("component", component)):
            if not 1 <= number <= 255:
                raise BadInput(name, "be from 1 to 255", number)
        self.codec = MessageCodec(system, component, key)
        self.socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self.peer: Any = None
        self.unsent = 0
        self._fixed = kind == "udpout"
        self._signed = key is not None
        self._caller: Any = None  # who sent last while the vehicle is unknown
        try:
            if kind == "udpout":
                self.peer = socket.gethostbyname(address[0]), address[1]
                self.socket.bind(("", 0))
            else:
                self.socket.bind(address)
        except OSError as error:
            self.socket.close()
            hint = "Another program may be listening there"
            raise BadInput("connect", "be free to use", f"{endpoint}: {error.strerror}", hint=hint) from None
        self.port = self.socket.getsockname()[1]

    def __enter__(self) -> "UdpLink":
        return self

    def __exit__(self, *error: Any) -> None:
        self.socket.close()

    def receive(self, longest: float) -> list[tuple[Any, Any]]:
        """Messages of all datagrams that are there, each with its sender; it waits for one, at most `longest`, s.

        With `udpout` only those of the vehicle.
        """
        messages: list[tuple[Any, Any]] = []
        for k in range(_AT_ONCE):
            self.socket.settimeout(0.0 if k else longest)
            try:
                data, sender = self.socket.recvfrom(_LONGEST)
            except OSError:  # nothing there, or nobody listens on the other side
                break
            self._caller = sender
            if not self._fixed or sender == self.peer:
                messages += [(message, sender) for message in self.codec.parsed(data)]
        return messages

    def drain(self) -> None:
        """Forget what has come so far: it is old."""
        for _ in range(_AT_ONCE):
            if not self.receive(0.0):
                break

    def send(self, messages: list[Any]) -> None:
        """Send messages to the vehicle, if its address is known.

        With signatures, who sends meanwhile gets them: an autopilot without a clock sets the time of its signatures by
        those that it receives, and until then they are old.
        """
        peer = self._caller if self.peer is None and self._signed else self.peer
        if peer is None:
            return
        for data in self.codec.packed(messages):
            try:
                self.socket.sendto(data, peer)
            except OSError:  # the vehicle notices that commands are missing, and the next one may get through
                self.unsent += 1


def _parsed(endpoint: str) -> tuple[str, tuple[str, int]]:
    """Kind and address of `udpin:HOST:PORT`."""
    kind, _, host_and_port = endpoint.partition(":")
    host, _, port = host_and_port.rpartition(":")
    lowest = 1 if kind == "udpout" else 0  # of which a listener gets any that is free
    if kind not in _KINDS or not host or not port.isdecimal() or not lowest <= int(port) <= 65535:
        hint = "For a serial line, start a router such as mavlink-router or MAVProxy"
        raise BadInput("connect", "be udpin:HOST:PORT or udpout:HOST:PORT", endpoint, hint=hint)
    return kind, (host, int(port))
