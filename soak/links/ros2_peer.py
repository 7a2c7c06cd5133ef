"""A vehicle's node at the other end of `undertow ros2`."""

import random
import time as clock
from typing import Any

import numpy as np

from soak.links.peer import AbstractPeer, Measured
from undertow.core.errors import BadInput
from undertow.outside.ros2 import messages as ros
from undertow.outside.ros2.from_messages import SECOND, Frames, PoseAndVelocity, thrusters_from
from undertow.outside.ros2.link import Link
from undertow.outside.ros2.to_messages import odometry_of, stamp_of

_THRUSTERS, _LABEL = 8, "thrusters, V"


class Ros2Peer(AbstractPeer):
    """A participant in a domain of its own.

    Args:
        domain: number.
        out: folder for the bag of the command.
    """

    def __init__(self, domain: int, out: str):
        self.arguments = ["ros2", "SCENARIO", "--localhost", "--domain", str(domain), "--bag", out]
        self._link = Link(domain, True)
        self._outlet = self._link.publisher("/odom", ros.Odometry)
        self._commands = self._link.subscriber("/thrusters", ros.Float64MultiArray)

    def begin(self, chance: random.Random) -> None:
        self._chance = chance
        self._commands.take()
        self._origin: float | None = None  # s, of this machine's time less that of the vehicle

    def items(self, measured: Measured, time: float) -> list[Any]:
        return [self._odometry(measured, time, Frames())]

    def send(self, item: ros.Odometry) -> None:
        self._outlet.publish(item)

    def garbage(self, like: ros.Odometry) -> list[Any]:
        nan = Measured(np.full(3, np.nan), np.full(4, np.nan), np.full(6, np.nan))
        return [self._odometry(nan, clock.time() - (self._origin or 0.0), Frames())]

    def other_version(self, measured: Measured, time: float) -> list[Any]:
        return [self._odometry(measured, time, Frames(("earth",), "camera"))]

    def from_another(self, measured: Measured, time: float) -> None:
        """ROS 2 does not say who sent a message: nothing tells these from the vehicle's own, but for the frame."""
        away = measured._replace(position=measured.position + 50.0)
        self._outlet.publish(self._odometry(away, time, Frames(("earth",), "base_link")))

    def take(self, longest: float) -> tuple[np.ndarray | None, int]:
        self._link.wait(longest)
        arrived = self._commands.take()
        newest = None
        for message in arrived:
            try:
                newest = thrusters_from(message, _THRUSTERS, message.layout.dim[0].label, "/thrusters")
            except (BadInput, IndexError):
                continue
        return newest, len(arrived)

    def close(self) -> None:
        self._link.close()

    def _odometry(self, measured: Measured, time: float, frames: Frames) -> ros.Odometry:
        if self._origin is None:
            self._origin = clock.time() - time
        motion = PoseAndVelocity(measured.position, measured.attitude, measured.velocity)
        stamp = min(max(0, round((self._origin + time) * SECOND)), 2**31 * SECOND - 1)
        return odometry_of(motion, stamp_of(stamp), frames)
