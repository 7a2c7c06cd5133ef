"""Somebody else's side of a node, for tests: it sends odometry and commands, and sees what the node sends."""

import threading
import time

import numpy as np

from undertow.outside.realtime.control_loop import RealTimeLoop
from undertow.outside.realtime.loop_clock import MonotonicClock
from undertow.outside.realtime.loop_settings import LoopSettings
from undertow.outside.ros2 import messages as ros
from undertow.outside.ros2.controller_link import ControllerLink, ControllerSettings
from undertow.outside.ros2.from_messages import SECOND, Frames, PoseAndVelocity
from undertow.outside.ros2.link import Link
from undertow.outside.ros2.node import Reporter
from undertow.outside.ros2.to_messages import odometry_of, stamp_of

STILL = PoseAndVelocity(np.zeros(3), np.array([1.0, 0, 0, 0]), np.zeros(6))


class Peer:
    """Publishes what a controller takes; `commands` are those that it sent."""

    def __init__(self, domain: int, topic: str = "/thrusters", kind=ros.Float64MultiArray, reliability="reliable"):
        self.link = Link(domain, True, reliability)
        self.odometry = self.link.publisher("/odom", ros.Odometry)
        self.target = self.link.publisher("/target_pose", ros.PoseStamped)
        self.clock = self.link.publisher("/clock", ros.Clock)
        self.commands = self.link.subscriber(topic, kind)

    def send(self, seconds: float, motion: PoseAndVelocity = STILL, frames: Frames = Frames()) -> None:  # noqa: B008
        """Odometry with a stamp."""
        self.odometry.publish(odometry_of(motion, stamp_of(round(seconds * SECOND)), frames))

    def tell_time(self, seconds: float) -> None:
        """Time of /clock."""
        self.clock.publish(ros.Clock(stamp_of(round(seconds * SECOND))))


class ControllerNode:
    """A controller on its topics, turn by turn."""

    def __init__(self, controller, link: Link, settings: ControllerSettings, reporter: Reporter):
        self.topics = ControllerLink(controller, link, settings, reporter)
        loop_settings = LoopSettings(max_age=settings.max_age)
        self.loop = RealTimeLoop(controller.autopilot, self.topics, MonotonicClock(), loop_settings)

    def spin(self, seconds: float) -> None:
        """Wait for odometry, at most so long, and answer it."""
        self.loop.turn(self.topics, seconds)

    def status(self) -> str:
        """Counts and complaints in one line."""
        return self.loop.counts_line(self.topics)

    @property
    def counts(self) -> dict[str, int]:
        """What happened on the topics."""
        return self.topics.counts()

    def stop(self) -> None:
        """Send the last command."""
        self.topics.finish(np.zeros(8))


class Said:
    """Lines of a reporter."""

    def __init__(self):
        self.lines: list[str] = []

    def __call__(self, line: str) -> None:
        self.lines.append(line)

    @property
    def warnings(self) -> list[str]:
        return [line for line in self.lines if line.startswith("Warning: ")]


def until(condition, seconds: float = 10.0):
    """Wait for a condition and return what it gives."""
    end = time.monotonic() + seconds
    while not (found := condition()):
        assert time.monotonic() < end, "it did not happen"
        time.sleep(0.002)
    return found


class Running(threading.Thread):
    """Something that runs in a thread; `result` is what it returned or raised."""

    def __init__(self, work):
        super().__init__(daemon=True)
        self._work, self.result = work, None
        self.start()

    def run(self):
        try:
            self.result = self._work()
        except Exception as error:
            self.result = error
