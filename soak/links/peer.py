"""The vehicle's side of a link: it says where the vehicle is, and takes commands."""

import abc
import random
from typing import Any, NamedTuple

import numpy as np

from undertow.outside.autopilot.measured_motion import MeasuredMotion


class Measured(NamedTuple):
    """A measurement: m, unit quaternion w, x, y, z, and m/s and rad/s in body axes."""

    position: np.ndarray
    attitude: np.ndarray
    velocity: np.ndarray


class AbstractPeer(abc.ABC):
    """What is sent are items: datagrams, or messages of a middleware.

    Attributes:
        arguments: of `undertow`, with `SCENARIO` in place of the file.
    """

    arguments: list[str]

    @abc.abstractmethod
    def begin(self, chance: random.Random) -> None:
        """A new vehicle is there; whatever waits is forgotten."""

    @abc.abstractmethod
    def items(self, measured: Measured, time: float) -> list[Any]:
        """A measurement at a time of the vehicle's clock, s."""

    @abc.abstractmethod
    def send(self, item: Any) -> None:
        """Send an item to the command."""

    @abc.abstractmethod
    def garbage(self, like: Any) -> list[Any]:
        """Items that are none, made of one that is."""

    @abc.abstractmethod
    def other_version(self, measured: Measured, time: float) -> list[Any]:
        """A measurement in another version of the protocol, or in other axes."""

    @abc.abstractmethod
    def from_another(self, measured: Measured, time: float) -> None:
        """Send a measurement as somebody else who is on the link, too."""

    @abc.abstractmethod
    def take(self, longest: float) -> tuple[np.ndarray | None, int]:
        """The newest command, V, and how many came; it waits for one, at most `longest`, s."""

    @abc.abstractmethod
    def close(self) -> None:
        """Leave the link."""


def measured_of(motion: MeasuredMotion) -> Measured:
    """What an ideal navigation measures."""
    return Measured(motion.position, motion.attitude, motion.velocity)


def altered(measured: Measured, what: str) -> Measured:
    """A measurement with one of `plan.WILD`."""
    name, size = what.split()[:2]
    position, attitude, velocity = (np.array(vector) for vector in measured)
    if name == "position":
        position = position + np.array([float(size), 0.0, 0.0])
    elif name == "velocity":
        velocity = velocity + np.array([float(size), 0.0, 0.0, 0.0, 0.0, 0.0])
    elif name == "rates":
        velocity = velocity + np.array([0.0, 0.0, 0.0, 0.0, 0.0, float(size)])
    elif name == "heading":
        half = 0.5 * float(size)
        w, x, y, z = attitude
        c, s = np.cos(half), np.sin(half)
        attitude = np.array([c * w - s * z, c * x - s * y, c * y + s * x, c * z + s * w])
    else:
        attitude = np.zeros(4)
    return Measured(position, attitude, velocity)


def damaged(data: bytes, chance: random.Random) -> list[bytes]:
    """Bytes that are no datagram, one with bits that are turned, and one that is cut off."""
    flipped = bytearray(data)
    for _ in range(chance.randint(1, 4)):
        flipped[chance.randrange(len(flipped))] ^= 1 << chance.randrange(8)
    return [chance.randbytes(chance.randint(0, 1400)), bytes(flipped), data[: chance.randrange(len(data))]]
