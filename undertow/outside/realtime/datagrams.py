"""Datagrams between a controller and a vehicle: fixed size, numbered, dated, with a checksum.

All numbers are little-endian. A header of 28 bytes, the numbers, and CRC-32 (as of zlib) of all bytes before it:

    offset  size  what
    0       4     magic, the letters UTOW
    4       1     version, 1
    5       1     kind: 1 measurement, 2 command
    6       1     flags; of a measurement: 1, the applied input is known; of a command: 1, control has not begun
    7       1     number n of actuators
    8       4     session: any number that the sender chose when it started
    12      4     sequence number: 1 or more, and larger in every later datagram; after 2^32 - 1 comes 1
    16      8     time of the sender, ns since any origin
    24      4     sequence number of the newest datagram that was received from the other side; 0 without one
    28      8 m   numbers, double precision
    28+8m   4     checksum

A measurement has m = 13 + n numbers: north, east, down (m); the unit quaternion w, x, y, z (body -> world); u, v, w, p,
q, r (body axes, m/s, rad/s); the input applied since the last measurement, per actuator. A command has m = n: the input
of each actuator, in the unit of the thruster model, usually V.
"""

import struct
import zlib
from typing import NamedTuple

import numpy as np

from undertow.core.errors import BadInput
from undertow.outside.realtime.plausible_motion import is_plausible

MEASUREMENT, COMMAND = 1, 2
FLAG = 1
MOTION = 13  # numbers of the motion

_HEADER, _SUM = struct.Struct("<4sBBBBIIqI"), struct.Struct("<I")
_MAGIC, _VERSION = b"UTOW", 1
_SEQUENCES = 2**32
_WINDOW = 10_000  # datagrams that may be lost in a row

# Numbers beyond are of no vehicle: m, m/s, rad/s, V, N.
_LARGEST = 1e6
_UNIT = 1e-3  # largest departure of a quaternion's square from 1


class Datagram(NamedTuple):
    """A datagram.

    Attributes:
        kind: `MEASUREMENT` or `COMMAND`.
        flag: see the module.
        session, sequence: numbers.
        time: ns.
        answered: sequence number of the newest datagram from the other side.
        values: the numbers.
    """

    kind: int
    flag: bool
    session: int
    sequence: int
    time: int
    answered: int
    values: np.ndarray

    def packed(self, actuators: int) -> bytes:
        """As bytes, for a vehicle of so many actuators."""
        numbers = (self.session, self.sequence, self.time, self.answered)
        head = _HEADER.pack(_MAGIC, _VERSION, self.kind, FLAG * self.flag, actuators, *numbers)
        checked = head + np.asarray(self.values, dtype="<f8").tobytes()
        return checked + _SUM.pack(zlib.crc32(checked))


class Refused(Exception):
    """A datagram that cannot be used; its text is the name under which it is counted."""


def size_of(kind: int, actuators: int) -> int:
    """Bytes of a datagram of a kind."""
    return _HEADER.size + 8 * (actuators + (MOTION if kind == MEASUREMENT else 0)) + _SUM.size


def unpacked(data: bytes, kind: int, actuators: int) -> Datagram:
    """A datagram of a kind from its bytes, whatever they are.

    Raises:
        Refused: wrong size; damaged; foreign (another format, version or kind); invalid (a number that is infinite or
            far beyond any vehicle, NaN in anything but a measurement, or a quaternion that is none); implausible (see
            `plausible_motion`).
    """
    if len(data) != size_of(kind, actuators):
        raise Refused("wrong size")
    checked = data[: -_SUM.size]
    (checksum,) = _SUM.unpack(data[-_SUM.size :])
    if zlib.crc32(checked) != checksum:
        raise Refused("damaged")
    magic, version, kind_received, flags, count, session, sequence, time, answered = _HEADER.unpack_from(checked)
    if (magic, version, kind_received, count) != (_MAGIC, _VERSION, kind, actuators) or flags not in (0, FLAG):
        raise Refused("foreign")
    values = np.frombuffer(checked, dtype="<f8", offset=_HEADER.size).astype(float)
    unknown = np.isnan(values) & (kind == MEASUREMENT)  # what was not measured
    if not (unknown | (np.abs(values) < _LARGEST)).all():
        raise Refused("invalid")
    if kind == MEASUREMENT and abs((values[3:7] ** 2).sum() - 1) > _UNIT:  # false for NaN
        raise Refused("invalid")
    if kind == MEASUREMENT and not is_plausible(values[:3], values[7:MOTION]):
        raise Refused("implausible")
    return Datagram(kind, bool(flags), session, sequence, time, answered, values)


class DatagramFilter:
    """Judges the datagrams of one side: only those of one session, each later than the last.

    Args:
        kind: that is expected.
        actuators: of the vehicle.

    Attributes:
        counts: of datagrams that were accepted and refused, by reason.
        newest: the one accepted last; None before.
    """

    def __init__(self, kind: int, actuators: int):
        self._kind, self._actuators = kind, actuators
        names = ("received", "wrong size", "damaged", "foreign", "invalid", "implausible", "other session")
        names += ("repeated", "far ahead", "left unread")
        self.counts: dict[str, int] = dict.fromkeys(names, 0)
        self.newest: Datagram | None = None
        self._far_ahead = 0  # sequence number of the last datagram that was ahead

    def take(self, data: bytes) -> Datagram | None:
        """The datagram, if it can be used; otherwise it is counted."""
        try:
            datagram = unpacked(data, self._kind, self._actuators)
            if self.newest is not None and datagram.session != self.newest.session:
                raise Refused("other session")
            self._check_order(datagram.sequence)
        except Refused as why:
            self.counts[str(why)] += 1
            return None
        self.counts["received"] += 1
        self.newest = datagram
        return datagram

    def _check_order(self, sequence: int) -> None:
        """Check that a datagram is later than the last one; one far ahead counts where another follows it.

        Otherwise a single datagram of a wrong number would end the connection.
        """
        if sequence == 0:
            raise Refused("repeated")
        if self.newest is not None:
            ahead = (sequence - self.newest.sequence) % _SEQUENCES
            if not 0 < ahead <= _SEQUENCES // 2:
                raise Refused("repeated")
            if ahead > _WINDOW and not 0 < (sequence - self._far_ahead) % _SEQUENCES <= _WINDOW:
                self._far_ahead = sequence
                raise Refused("far ahead")
        self._far_ahead = sequence


class Sender:
    """Numbers the datagrams of one side.

    Args:
        kind: of what is sent.
        actuators: of the vehicle.
        session: number.
    """

    def __init__(self, kind: int, actuators: int, session: int):
        self._kind, self._actuators, self._session, self._sequence = kind, actuators, session, 0

    def pack(self, values: np.ndarray, time: int, answered: int, flag: bool = False) -> bytes:
        """The next datagram."""
        self._sequence = _next(self._sequence, 1)
        return self._packed(self._sequence, values, time, answered, flag)

    def following(self, values: np.ndarray, time: int, count: int) -> list[bytes]:
        """The datagrams after the next one, should somebody else send them."""
        return [self._packed(_next(self._sequence, k), values, time, 0, False) for k in range(2, count + 2)]

    def _packed(self, sequence: int, values: np.ndarray, time: int, answered: int, flag: bool) -> bytes:
        datagram = Datagram(self._kind, flag, self._session, sequence, time, answered, values)
        return datagram.packed(self._actuators)


def _next(sequence: int, steps: int) -> int:
    """Sequence number so many datagrams later; 0 is none."""
    return (sequence + steps - 1) % (_SEQUENCES - 1) + 1


def address_of(address: str, name: str) -> tuple[str, int]:
    """Host and port of HOST:PORT.

    Raises:
        BadInput: it is none.
    """
    host, colon, port = address.rpartition(":")
    if not (colon and host and port.isascii() and port.isdecimal() and 0 < int(port) < 65536):
        raise BadInput(name, "be HOST:PORT with a port from 1 to 65535", repr(address))
    return host, int(port)
