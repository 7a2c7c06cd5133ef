"""A driver on the vehicle, at the other end of `undertow run --link udp:...`."""

import random
import socket
from typing import Any

import numpy as np

from soak.links.peer import AbstractPeer, Measured, damaged
from undertow.outside.realtime.datagrams import COMMAND, MEASUREMENT, Datagram, DatagramFilter, Sender

_THRUSTERS = 8
_LONGEST = 2048  # bytes
_SESSION = slice(8, 12)  # in a datagram


class UdpPeer(AbstractPeer):
    """It listens on a port of its own, and answers to where commands come from.

    Args:
        out: folder for the results of the command.
    """

    def __init__(self, out: str):
        self._socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._socket.bind(("127.0.0.1", 0))
        self._foreign_socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._received = DatagramFilter(COMMAND, _THRUSTERS)
        address = f"127.0.0.1:{self._socket.getsockname()[1]}"
        self.arguments = [
            "run",
            "SCENARIO",
            "--link",
            f"udp:{address}",
            "--patience",
            "60",
            "--out",
            out,
            "--overwrite",
        ]

    def begin(self, chance: random.Random) -> None:
        self._chance, self._address = chance, None
        before = self._received.newest
        self._session_before = b"" if before is None else before.session.to_bytes(4, "little")
        self._sender = Sender(MEASUREMENT, _THRUSTERS, chance.getrandbits(32))
        self._received = DatagramFilter(COMMAND, _THRUSTERS)
        while self._receive(0.0) is not None:
            pass

    def items(self, measured: Measured, time: float) -> list[Any]:
        return [self._sender.pack(_numbers(measured), round(1e9 * time), 0)]

    def send(self, item: bytes) -> None:
        self._transmit(self._socket, item)

    def garbage(self, like: bytes) -> list[Any]:
        return list(damaged(like, self._chance))

    def other_version(self, measured: Measured, time: float) -> list[Any]:
        session, sequence = self._chance.getrandbits(32), self._chance.getrandbits(32)
        restarted = Datagram(MEASUREMENT, False, session, 1, 0, 0, _numbers(measured)).packed(_THRUSTERS)
        newest = self._received.newest
        current_session = 0 if newest is None else newest.session
        reflected = Datagram(COMMAND, False, current_session, sequence, 0, 0, np.zeros(_THRUSTERS)).packed(_THRUSTERS)
        return [restarted, reflected, restarted[:4] + b"\x02" + restarted[5:]]

    def from_another(self, measured: Measured, time: float) -> None:
        foreign_sender = Sender(MEASUREMENT, _THRUSTERS, self._chance.getrandbits(32))
        self._transmit(self._foreign_socket, foreign_sender.pack(_numbers(measured), round(1e9 * time), 0))

    def take(self, longest: float) -> tuple[np.ndarray | None, int]:
        newest, count = None, 0
        while (data := self._receive(0.0 if count else longest)) is not None:
            count += 1
            if data[_SESSION] == self._session_before:  # on its way when the earlier run ended
                continue
            command = self._received.take(data)
            newest = newest if command is None or command.flag else command.values
        return newest, count

    def close(self) -> None:
        self._socket.close()
        self._foreign_socket.close()

    def _receive(self, longest: float) -> bytes | None:
        self._socket.settimeout(longest)
        try:
            data, self._address = self._socket.recvfrom(_LONGEST)
        except OSError:
            return None
        return data

    def _transmit(self, by: socket.socket, data: bytes) -> None:
        if self._address is not None:
            by.sendto(data, self._address)


def _numbers(measured: Measured) -> np.ndarray:
    return np.concatenate([measured.position, measured.attitude, measured.velocity, np.zeros(_THRUSTERS)])
