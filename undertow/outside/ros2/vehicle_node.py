"""The vehicle of a scenario as a ROS 2 node: thruster commands in; odometry, IMU readings and /clock out.

Three paces: `lock-step` holds the time until the command for the last odometry has come, so that a run is repeatable;
`real-time` and `fast` apply the newest command. Without a command for `max_age` (s, of this machine's time) they apply
no input; `lock-step` ends with an error.
"""

import time
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from undertow.core import checks
from undertow.core.errors import BadInput
from undertow.core.status import Status
from undertow.outside.autopilot.vehicle import Vehicle, VehicleOutput
from undertow.outside.ros2 import messages as ros
from undertow.outside.ros2.from_messages import SECOND, Frames, PoseAndVelocity, thruster_label, thrusters_from
from undertow.outside.ros2.link import Link, why_nothing
from undertow.outside.ros2.node import WAIT, Reporter, Topics
from undertow.outside.ros2.to_messages import imu_of, odometry_of, stamp_of

PACES = ("real-time", "lock-step", "fast")

_BEHIND = 0.1  # s, behind the real time, from which the simulation is said to be too slow


class VehicleSettings(NamedTuple):
    """How the simulated vehicle is run as a node.

    Attributes:
        pace: `real-time`, `lock-step` or `fast`.
        duration: s, simulated; None for the scenario's.
        max_age: s, without a command, until no input is applied.
        patience: s, for which `lock-step` waits for a command.
        first_patience: s, for which it waits for a controller, which may have to be compiled first.
        topics, frames: names.
    """

    pace: str = "real-time"
    duration: float | None = None
    max_age: float = 0.5
    patience: float = 30.0
    first_patience: float = 120.0
    topics: Topics = Topics()
    frames: Frames = Frames()


class VehicleNode:
    """A simulated vehicle, connected to a link.

    Args:
        vehicle: compiled.
        link: participant.
        settings: see there.
        reporter: gets what happens.

    Raises:
        BadInput: something given cannot be used.
    """

    def __init__(self, vehicle: Vehicle, link: Link, settings: VehicleSettings, reporter: Reporter):
        checks.choice("pace", settings.pace, PACES)
        for name in ("max_age", "patience", "first_patience"):
            checks.positive(name, getattr(settings, name), "s", finite=False)
        self._vehicle = vehicle
        self._steps = self._steps_of(vehicle.duration if settings.duration is None else settings.duration)
        self._settings, self._link, self._reporter = settings, link, reporter
        self._label = thruster_label(vehicle.unit)
        topics = settings.topics
        self._commands = link.subscriber(topics.thrusters, ros.Float64MultiArray)
        self._clock = link.publisher(topics.clock, ros.Clock)
        self._odometry = link.publisher(topics.odom, ros.Odometry)
        self._imu = link.publisher(topics.imu, ros.Imu)
        self._time = 0  # ns
        link.now = lambda: self._time
        self._command = np.zeros(self._vehicle.thrusters)
        self._last = time.monotonic()

    def run(self) -> Status:
        """Run to the end, or until KeyboardInterrupt; how the run ended."""
        lock_step = self._settings.pace == "lock-step"
        if lock_step:
            self._await_controller()
        observed = self._vehicle.restart()
        k = 0
        begun = time.monotonic()
        while True:
            if lock_step and self._commands.take():
                self._reporter.trouble("unasked commands", "a command came before its odometry: it is ignored")
            self._publish(observed, k)
            self._reporter.status(self.status, self._commands)
            if lock_step:
                self._await_command()
            elif k < self._steps:
                self._keep_pace(begun + (k + 1) * self._vehicle.sampling_time)
            if k >= self._steps or observed.status is not Status.OK:
                self._link.flush(0.5)
                return observed.status
            observed = self._vehicle.step(self._command)
            k += 1

    def status(self) -> str:
        """Time and counts in one line."""
        malformed = f", {self._commands.malformed} malformed" if self._commands.malformed else ""
        counts = f"{self._odometry.sent} odometry, {self._commands.received} commands"
        return f"{self._time / SECOND:.1f} s simulated, {counts}{malformed}{self._reporter.events()}"

    def _steps_of(self, duration: float) -> float:
        """Number of control steps; infinite for a run without end."""
        checks.positive("duration", duration, "s", finite=False)
        steps = duration / self._vehicle.sampling_time
        if steps < 0.5:
            must = f"be at least one control step ({self._vehicle.sampling_time:g} s)"
            raise BadInput("duration", must, f"{duration:g} s")
        return steps if steps == np.inf else round(steps)

    def _publish(self, observed: VehicleOutput, k: int) -> None:
        """Send the time, then what is observed at it."""
        self._time = round(k * self._vehicle.sampling_time * SECOND)
        stamp = stamp_of(self._time)
        frames = self._settings.frames
        motion = PoseAndVelocity(observed.position, observed.attitude, observed.velocity)
        self._clock.publish(ros.Clock(stamp))
        self._imu.publish(imu_of(motion, observed.specific_force, stamp, frames))
        self._odometry.publish(odometry_of(motion, stamp, frames))

    def _take_command(self) -> bool:
        """Take the newest command that can be used; whether there was one."""
        command: NDArray | None = None
        for message in self._commands.take():
            try:
                command = thrusters_from(message, self._vehicle.thrusters, self._label, self._commands.topic)
            except BadInput as error:
                if self._settings.pace == "lock-step":
                    raise
                self._reporter.trouble(f"ignored ({error.name})", f"{error}. The command is ignored")
        if command is None:
            return False
        self._command = command
        self._last = time.monotonic()
        self._reporter.over("stopped")
        return True

    def _await_controller(self) -> None:
        """Wait for a controller that takes odometry and gives commands."""
        until = time.monotonic() + self._settings.first_patience
        while not (self._odometry.subscribers() and self._commands.publishers()):
            if time.monotonic() > until:
                raise BadInput(
                    "", "", f"no controller: {why_nothing(self._link, self._commands, ros.Float64MultiArray)}"
                )
            self._reporter.status(lambda: f"waiting for a controller on {self._odometry.topic}")
            time.sleep(0.01)

    def _await_command(self) -> None:
        until = time.monotonic() + self._settings.patience
        while not self._take_command():
            if time.monotonic() > until:
                awaited = f"the odometry of {self._time / SECOND:g} s"
                why = f"no command came for {awaited} within {self._settings.patience:g} s"
                raise BadInput("", "", why)
            self._link.wait(WAIT)
            self._reporter.status(self.status, self._commands)

    def _keep_pace(self, until: float) -> None:
        """Take commands until an instant of this machine's time; at once in `fast`."""
        self._take_command()
        if self._settings.pace == "real-time":
            while (left := until - time.monotonic()) > 0:
                self._link.wait(min(left, WAIT))
                self._take_command()
            if left < -_BEHIND:
                self._reporter.trouble("steps behind", "the simulation is slower than real time")
        if time.monotonic() - self._last > self._settings.max_age and self._command.any():
            why = f"no command for {self._settings.max_age:g} s: no input is applied until there is one again"
            self._reporter.trouble("stopped", why)
            self._command = np.zeros_like(self._command)
