"""The controller of a scenario as a ROS 2 node: odometry and target in, thruster commands or a wrench out.

It steps when odometry arrives, by the time between the stamps. What goes wrong, and what it then does:

    another frame, a quaternion not of unit length    the message is ignored
    a number that is not finite                       it was not measured: the law takes what its model expects
    a stamp older than `max_age`                      the message is ignored
    a stamp before the last one                       ignored; by more than `RESTART` the controller starts again
    no odometry that can be used for `max_age`        zero thrust is commanded until there is some again

Ages are in the time that is used: where that of /clock stands still, nothing grows old.
"""

import time
from pathlib import Path
from typing import Any, NamedTuple

import jax.numpy as jnp
import numpy as np
from numpy.typing import NDArray

from undertow.autopilot.autopilot import Autopilot
from undertow.autopilot.output import Output, output_of
from undertow.core import checks, runtime
from undertow.core.errors import BadInput
from undertow.interop.ros2 import messages as ros
from undertow.interop.ros2.checked_scenario import check_vehicle
from undertow.interop.ros2.from_messages import (
    SECOND,
    Frames,
    PoseAndVelocity,
    motion_of,
    nanoseconds_of,
    target_of,
    thruster_label,
)
from undertow.interop.ros2.link import Link, why_nothing
from undertow.interop.ros2.node import WAIT, Reporter, Topics
from undertow.interop.ros2.to_messages import stamp_of, thrusters_of, wrench_of
from undertow.loop.stepped import put, step_of
from undertow.scenario.build import build
from undertow.scenario.link_scenario import at_sampling_time, read_for_link

RESTART = 0.1  # s, by which a clock must go back to be one that was set back

_EXACT = 2  # ns, within which stamps are one sampling time apart
_ABSENT = 3.0  # s, after which missing odometry is explained


class ControllerSettings(NamedTuple):
    """How the controller is run as a node.

    Attributes:
        max_age: s, of the newest odometry, until zero thrust is commanded; also of a stamp, until it is ignored.
        use_sim_time: whether the time is that of /clock.
        topics, frames: names.
    """

    max_age: float = 0.5
    use_sim_time: bool = False
    topics: Topics = Topics()
    frames: Frames = Frames()


class CompiledController:
    """The controller of a scenario, compiled, with its output.

    Commands are limited to what the thrusters can give, so that the law adapts to what is applied; a battery counts as
    full.

    Args:
        scenario: a .yaml file or an earlier run.nc, of a vehicle.
        output: `input`, `newtons` or `pulses` (one number per thruster), or `wrench`.
        rate: control steps per second; None for the scenario's.
        unsupervised: whether there is no supervisor where the scenario has none.
        allow_code: whether the Python code that an earlier run.nc names may run.

    Attributes:
        autopilot: it gives inputs.
        output: as given.
        thrusters: how many.
        label: of an array of outputs.

    Raises:
        BadInput: something given cannot be used.
    """

    def __init__(
        self,
        scenario: Path,
        output: str = "input",
        rate: float | None = None,
        *,
        unsupervised: bool = False,
        allow_code: bool = False,
    ):
        if rate is not None:
            checks.positive("rate", rate, "Hz")
        text = read_for_link(scenario, allow_code=allow_code, unsupervised=unsupervised)
        text = at_sampling_time(text, None if rate is None else 1 / rate)
        built = build(text)
        check_vehicle(built)
        plant, law = built.closed_loop.plant, built.closed_loop.controller
        self.autopilot = Autopilot(text, attitude="quaternion", velocity="body")
        self.output, self.thrusters = output, plant.inputs()
        with runtime.on_processor(), runtime.in_precision(built.scenario.precision):
            conversion = output_of(output, plant, law, None)
            self.label = thruster_label(conversion.unit)
            self._conversion = step_of(_limited, conversion, (), jnp.zeros(self.thrusters))

    def limited(self, u: NDArray) -> tuple[NDArray, NDArray]:
        """An input as far as the thrusters can give it, and the same as output."""
        put(self._conversion.inputs, u)
        self._conversion()
        applied, values = self._conversion.outputs
        return applied.copy(), values.copy()


def _limited(output: Output, _: Any, u: Any):
    applied = output.plant.admissible(output.plant.initial_state(), u)
    return (), (applied, output.of(applied))


class ControllerNode:
    """A controller, connected to a link.

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
        checks.positive("max_age", settings.max_age, "s", finite=False)
        self._controller, self._autopilot = controller, controller.autopilot
        self._period = round(self._autopilot.sampling_time * SECOND)
        self._settings, self._link, self._reporter = settings, link, reporter
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
        self._last: int | None = None  # stamp of the last step, ns; None before the start
        self._arrived = 0  # stamp of the last odometry, ns
        self._applied, self._target = np.zeros(controller.thrusters), None
        self._stopped = False  # whether zero thrust was commanded since the last step
        self._heartbeat: int | None = None  # when odometry was last used; ns, by `_elapsed`
        self._explained = time.monotonic()

    def run(self, duration: float = np.inf) -> None:
        """Control for so many seconds, or until KeyboardInterrupt; zero thrust is the last command in either case."""
        until = time.monotonic() + duration
        try:
            while time.monotonic() < until:
                self.spin(min(WAIT, self._settings.max_age))
        finally:
            self.stop()

    def spin(self, seconds: float) -> None:
        """Wait for messages, at most so long, and answer them."""
        self._link.wait(seconds)
        self._take_clock()
        self._take_targets()
        arrived = self._odometry.take()
        self._reporter.counts["odometry superseded"] += max(0, len(arrived) - 1)
        if arrived:  # the newest counts
            try:
                self._answer(arrived[-1])
            except BadInput as error:
                self._reporter.trouble(f"ignored ({error.name})", f"{error}. The message is ignored")
        self._watch()
        self._reporter.status(self.status, self._odometry)

    def stop(self) -> None:
        """Command zero thrust, and wait a little until it has arrived."""
        self._publish(np.zeros_like(self._applied))
        self._link.flush(0.5)

    def status(self) -> str:
        """Counts in one line."""
        of_clock = {name: number for name, number in self._autopilot.counts.items() if name != "steps" and number}
        late = "".join(f", {number} steps {name}" for name, number in of_clock.items())
        malformed = f", {self._odometry.malformed} malformed" if self._odometry.malformed else ""
        received = f"{self._odometry.received} odometry, {self._targets.received} targets"
        supervision = "" if self._last is None else self._autopilot.supervision
        supervised = f", {supervision}" if supervision else ""
        return f"{received}, {self._commands.sent} commands{supervised}{late}{malformed}{self._reporter.events()}"

    def _now(self) -> int:
        """Time, ns: of /clock where that is used and there is one."""
        return time.time_ns() if self._simulated is None else self._simulated

    def _elapsed(self) -> int:
        """Time by which silence is measured, ns: setting the clock of this machine does not change it."""
        return time.monotonic_ns() if self._simulated is None else self._simulated

    def _take_clock(self) -> None:
        for message in self._clock.take() if self._clock else ():
            now, before = nanoseconds_of(message.clock), self._simulated
            if now < 0:
                self._reporter.trouble(
                    "ignored (/clock)", f"/clock is at {now / SECOND:g} s, before zero: it is ignored"
                )
                continue
            self._simulated = now
            if before is None or now < before - RESTART * SECOND:
                self._heartbeat = None if self._heartbeat is None else now
            if before is not None and now < before - RESTART * SECOND:
                back = f"/clock went back by {(before - now) / SECOND:g} s: the controller starts again"
                self._reporter.trouble("restarts", back)
                self._last = None

    def _take_targets(self) -> None:
        for message in self._targets.take():
            try:
                self._target = target_of(message, self._settings.frames, self._targets.topic)
            except BadInput as error:
                self._reporter.trouble(f"ignored ({error.name})", f"{error}. The target is ignored")

    def _answer(self, message: ros.Odometry) -> None:
        """Step and send the command, if a step is due."""
        stamp, topic = nanoseconds_of(message.header.stamp), self._odometry.topic
        motion = motion_of(message, self._settings.frames, topic)
        self._check_age(stamp, topic)
        before, self._arrived = self._arrived, stamp
        passed = None if self._last is None else stamp - self._last
        if passed is not None and passed < -RESTART * SECOND:
            back = f"{topic} went back in time by {-passed / SECOND:g} s: the controller starts again"
            self._reporter.trouble("restarts", back)
            passed = None
        if passed is not None and stamp <= before:
            self._arrived = before
            self._reporter.trouble("out of order", f"{topic} has stamps that do not increase. Those are ignored")
            return
        if passed is not None and passed + (stamp - before) / 2 < self._period:  # the next one is nearer to a step
            self._reporter.counts["odometry between steps"] += 1
            return
        command = self._start(motion) if passed is None else self._step(motion, passed)
        self._publish(command)
        self._last, self._stopped, self._heartbeat = stamp, False, self._elapsed()
        self._reporter.over("stopped")

    def _start(self, motion: PoseAndVelocity) -> NDArray:
        position, quaternion, velocity = motion
        applied = self._applied if self._stopped else None  # the output turns from zero thrust into the law's
        return self._autopilot.start(position, velocity, quaternion, target=self._target, applied=applied)

    def _step(self, motion: PoseAndVelocity, passed: int) -> NDArray:
        position, quaternion, velocity = motion
        dt = None if abs(passed - self._period) <= _EXACT else passed / SECOND
        return self._autopilot.step(position, velocity, quaternion, target=self._target, applied=self._applied, dt=dt)

    def _check_age(self, stamp: int, topic: str) -> None:
        if self._settings.use_sim_time and self._simulated is None:
            return
        age = (self._now() - stamp) / SECOND
        if age > self._settings.max_age:
            hint = "Set the clocks, or give a larger --max-age" if self._settings.use_sim_time or age < 1e6 else ""
            hint = hint or "Is this simulated time? Use --use-sim-time"
            must = f"be at most {self._settings.max_age:g} s old"
            raise BadInput(f"{topic} header.stamp", must, f"{age:.4g} s old", hint=hint)

    def _publish(self, u: NDArray) -> None:
        """Send an input, as far as the thrusters can give it, in the form of the output."""
        self._applied, values = self._controller.limited(u)
        if self._controller.output == "wrench":
            self._commands.publish(wrench_of(values, stamp_of(self._now()), self._settings.frames))
        else:
            self._commands.publish(thrusters_of(values, self._controller.label))

    def _watch(self) -> None:
        """Command zero thrust while there is no odometry; explain why there has been none yet."""
        if self._heartbeat is None:
            if time.monotonic() > self._explained + _ABSENT:
                why = why_nothing(self._link, self._odometry, ros.Odometry)
                self._reporter.warn(why, why)
                self._explained = time.monotonic()
        elif self._elapsed() - self._heartbeat > self._settings.max_age * SECOND:
            why = f"no odometry that can be used for {self._settings.max_age:g} s: zero thrust until there is some"
            self._reporter.trouble("stopped", why)
            self._publish(np.zeros_like(self._applied))
            self._stopped, self._heartbeat = True, self._elapsed()
