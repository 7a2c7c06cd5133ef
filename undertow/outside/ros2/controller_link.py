"""The controller of a scenario as a ROS 2 node: odometry and target in, thruster commands or a wrench out.

It is a link of the real-time loop, which steps when odometry arrives, by the time between the stamps. Of a message:

    another frame, a quaternion not of unit length    it is ignored
    a number that is not finite                       it was not measured: the law takes what its model expects
    a stamp older than `max_age`                      it is ignored
    a stamp that is not after the last one            it is ignored
    stamps of another time for half a second          the controller begins again with them
    /clock goes back by more than `RESTART`           the controller begins again

Ages are in the time that is used: where that of /clock stands still, nothing grows old.
"""

import time
from typing import Any, NamedTuple

import numpy as np

from undertow.core import checks
from undertow.core.errors import BadInput
from undertow.outside.autopilot.measured_motion import Format
from undertow.outside.realtime.link import AbstractPacingLink, LinkMeasurement
from undertow.outside.realtime.sender_clock import SenderClock
from undertow.outside.ros2 import messages as ros
from undertow.outside.ros2.compiled_controller import CompiledController
from undertow.outside.ros2.from_messages import SECOND, Frames, motion_of, nanoseconds_of, target_of
from undertow.outside.ros2.link import Link, why_nothing
from undertow.outside.ros2.node import Reporter, Topics, mixed_publishers
from undertow.outside.ros2.to_messages import stamp_of, thrusters_of, wrench_of

RESTART = 0.1  # s, by which /clock must go back to be one that was set back

_ABSENT = 3.0  # s, after which missing odometry is explained


class ControllerSettings(NamedTuple):
    """How the controller is run as a node.

    Attributes:
        max_age: s, of a stamp, until it is ignored.
        use_sim_time: whether the time is that of /clock.
        topics, frames: names.
    """

    max_age: float = 0.5
    use_sim_time: bool = False
    topics: Topics = Topics()
    frames: Frames = Frames()


class ControllerLink(AbstractPacingLink):
    """A controller's side of the topics.

    Args:
        controller: compiled.
        link: participant.
        settings: see there.
        reporter: gets what happens.

    Attributes:
        topic: of the commands.

    Raises:
        BadInput: something given cannot be used.
    """

    def __init__(self, controller: CompiledController, link: Link, settings: ControllerSettings, reporter: Reporter):
        checks.positive("max_age", settings.max_age, "s")
        self.form = Format("quaternion", "body")
        self._controller, self._settings, self._link, self._reporter = controller, settings, link, reporter
        topics = settings.topics
        self._odometry = link.subscriber(topics.odom, ros.Odometry)
        self._targets = link.subscriber(topics.target_pose, ros.PoseStamped)
        # Of any publisher: ROS 2's own quality of service of a clock is not reliable.
        clock = lambda: link.subscriber(topics.clock, ros.Clock, "best-effort")
        self._clock = clock() if settings.use_sim_time else None
        if controller.output == "wrench":
            self._commands: Any = link.publisher(topics.wrench, ros.WrenchStamped)
        else:
            self._commands = link.publisher(topics.thrusters, ros.Float64MultiArray)
        self.topic = self._commands.topic
        link.now = self._now
        self._simulated: int | None = None  # time of /clock, ns
        self._ahead = 0.0  # s, of the loop's clock before that of /clock when it came first
        self._senders = SenderClock(settings.max_age)
        self._begins_again = False  # at the next measurement: /clock was set back
        self._applied: np.ndarray | None = None  # last command, as far as the thrusters can give it
        self._target: np.ndarray | None = None
        self._used = False  # whether odometry was
        self._explained = time.monotonic()

    def wait(self, longest: float) -> None:
        self._link.wait(longest)
        self._take_clock()
        self._take_targets()
        self._explain_absence()

    def discard(self) -> None:
        self._odometry.take()

    def time(self, now: float) -> float:
        return now if self._simulated is None else self._simulated / SECOND + self._ahead

    def receive(self, elapsed: float) -> LinkMeasurement | None:
        arrived = self._odometry.take()
        self._reporter.counts["odometry superseded"] += max(0, len(arrived) - 1)
        if not arrived:
            return None
        try:
            return self._measurement(arrived[-1])  # the newest counts
        except BadInput as error:
            self._reporter.trouble(f"ignored ({error.name})", f"{error}. The message is ignored")
            return None

    def send(self, command: np.ndarray) -> None:
        """Send an input, as far as the thrusters can give it, in the form of the output."""
        self._applied, values = self._controller.limited(command)
        if self._controller.output == "wrench":
            self._commands.publish(wrench_of(values, stamp_of(self._now()), self._settings.frames))
        else:
            self._commands.publish(thrusters_of(values, self._controller.label))

    def finish(self, safe: np.ndarray) -> None:
        """Send the safe output, and wait a little until it has arrived."""
        self.send(safe)
        self._link.flush(0.5)

    def note_begin(self) -> None:
        self._reporter.over("stopped")

    def note_stop(self, reason: str) -> None:
        hint = ". Where odometry is slow, give its rate as --rate" if "irregular" in reason else ""
        self._reporter.trouble("stopped", f"{reason} from {self._odometry.topic}: zero thrust until that is over{hint}")

    def counts(self) -> dict[str, int]:
        counts = {"odometry": self._odometry.received, "targets": self._targets.received}
        counts |= {"commands": self._commands.sent, "malformed": self._odometry.malformed}
        return counts | dict(sorted(self._reporter.counts.items()))

    def complaints(self) -> list[str]:
        mixed = mixed_publishers(self._odometry)
        return [mixed] if mixed else []

    def _now(self) -> int:
        """Time, ns: of /clock where that is used and there is one."""
        return time.time_ns() if self._simulated is None else self._simulated

    def _take_clock(self) -> None:
        for message in self._clock.take() if self._clock else ():
            now = nanoseconds_of(message.clock)
            before = self._simulated
            if now < 0:
                self._reporter.trouble(
                    "ignored (/clock)", f"/clock is at {now / SECOND:g} s, before zero: it is ignored"
                )
                continue
            self._simulated = now
            if before is None:
                self._ahead = time.monotonic() - now / SECOND
            elif now < before - RESTART * SECOND:
                back = f"/clock went back by {(before - now) / SECOND:g} s: the controller begins again"
                self._reporter.trouble("restarts", back)
                self._senders = SenderClock(self._settings.max_age)
                self._begins_again = True

    def _take_targets(self) -> None:
        for message in self._targets.take():
            try:
                self._target = target_of(message, self._settings.frames, self._targets.topic)
            except BadInput as error:
                self._reporter.trouble(f"ignored ({error.name})", f"{error}. The target is ignored")

    def _measurement(self, message: ros.Odometry) -> LinkMeasurement | None:
        """The measurement of an odometry; None of one that is not of the present."""
        stamp = nanoseconds_of(message.header.stamp)
        topic = self._odometry.topic
        position, quaternion, velocity = motion_of(message, self._settings.frames, topic)
        self._check_age(stamp, topic)
        jumps = self._senders.jumps
        objection = self._senders.objection(stamp / SECOND, self.time(time.monotonic()))
        if objection == "old":
            self._reporter.trouble(
                "of another time", f"{topic} has stamps of another time than before. Those are ignored"
            )
            return None
        if objection:
            self._reporter.trouble("out of order", f"{topic} has stamps that do not increase. Those are ignored")
            return None
        if self._senders.jumps > jumps:
            self._reporter.trouble("restarts", f"the clock of {topic} was set: the controller begins again")
            self._begins_again = True
        elapsed = 0.0 if self._begins_again else None
        self._begins_again = False
        self._used = True
        return LinkMeasurement(
            position, velocity, quaternion, applied=self._applied, target=self._target, elapsed=elapsed, stamp=stamp
        )

    def _check_age(self, stamp: int, topic: str) -> None:
        if self._settings.use_sim_time and self._simulated is None:
            return
        age = (self._now() - stamp) / SECOND
        if age > self._settings.max_age:
            hint = "Set the clocks, or give a larger --max-age" if self._settings.use_sim_time or age < 1e6 else ""
            hint = hint or "Is this simulated time? Use --use-sim-time"
            must = f"be at most {self._settings.max_age:g} s old"
            raise BadInput(f"{topic} header.stamp", must, f"{age:.4g} s old", hint=hint)

    def _explain_absence(self) -> None:
        """Say why there has been no odometry yet."""
        if not self._used and time.monotonic() > self._explained + _ABSENT:
            why = why_nothing(self._link, self._odometry, ros.Odometry)
            self._reporter.warn(why, why)
            self._explained = time.monotonic()
