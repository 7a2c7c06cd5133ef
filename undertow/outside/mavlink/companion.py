"""The rules of a MAVLink companion: which odometry counts, whether a controller may run, what is asked for."""

from pathlib import Path
from typing import Any

import numpy as np
from pymavlink.dialects.v20 import common as mavlink

from undertow.core import checks
from undertow.core.errors import BadInput
from undertow.outside.autopilot.autopilot import Autopilot
from undertow.outside.mavlink.actuator_commands import MavlinkTarget
from undertow.outside.mavlink.message_requests import MessageRequests
from undertow.outside.mavlink.odometry import MavlinkOdometry, OdometryReader
from undertow.outside.mavlink.permission import Permission
from undertow.outside.mavlink.thruster_driver import ThrusterDriver
from undertow.outside.realtime.link import LinkMeasurement
from undertow.outside.realtime.plausible_motion import SPEED
from undertow.outside.realtime.sender_clock import SenderClock
from undertow.scenario.link_scenario import read_for_link

HEARTBEAT_PERIOD = 1.0  # s
LEAP = 1.0  # m by which a position may leap beyond what the largest plausible speed explains

_COUNTS: tuple[str, ...] = ("rejected commands", "foreign", "invalid")
_COUNTS += ("repeated", "out of order", "old")  # odometry that is not used
_COUNTS += ("clock jumps", "estimator resets", "leaps")

_HORIZONTAL = np.array([1.0, 1.0, 0.0])
_MICROSECOND = 1000  # ns


class Companion:
    """A controller's side of the talk with a vehicle's autopilot; messages only, without a socket.

    A controller may run while all of this holds:

    * HEARTBEAT of the target says that the vehicle is armed, and is no older than 3 s; nothing here arms it;
    * its flight mode is that in which the controller first ran since it was armed, and its status is neither emergency
      nor failsafe;
    * the position has not leapt since it was armed.

    It asks the autopilot for the messages with the odometry, see `message_requests`. Of a message:

    * from another system or component: ignored (`foreign`);
    * odometry in axes other than NED or FRD, of a failed estimator, or without its attitude: ignored (`invalid`);
    * odometry of the same time as the last, or an earlier one: ignored (`repeated`, `out of order`);
    * odometry whose time says that it is older than `timeout`, or of the future: ignored (`old`), unless that goes on
      for 0.5 s: then the clock of the vehicle was set (`clock jumps`), and the controller begins again;
    * another `reset_counter`: the estimator has jumped (`estimator resets`), and the controller begins again;
    * a position further from the last one than any vehicle moves in that time, and by more than 1 m: a leap (`leaps`),
      after which a controller runs only when the vehicle has been disarmed and armed again. Its target may be far away.

    Args:
        scenario: a .yaml file or an earlier run.nc.
        source: of the odometry, `odometry` or `local_position`.
        output: what the commands are, see `actuator_commands`.
        target_system, target_component: ids of the vehicle's autopilot: its heartbeat and its odometry count, and
            commands go to it.
        frame, channels: of the thrusters, see `thruster_channels`.
        timeout: s.
        relative: whether north and east of the reference count from where the controller first ran since the vehicle
            was armed; depth and heading never do.
        unsupervised: whether there is no supervisor where the scenario has none.
        allow_code: whether the Python code that an earlier run.nc names may run.

    Attributes:
        autopilot: the controller.
        counts: what happened so far.
        complaint: why the last message was ignored, or a command was rejected.
        timeout: s.
        channels: of the thrusters.

    Raises:
        BadInput: something given cannot be used.
    """

    def __init__(
        self,
        scenario: str | Path,
        *,
        source: str = "odometry",
        output: str = "rc_override",
        target_system: int = 1,
        target_component: int = mavlink.MAV_COMP_ID_AUTOPILOT1,
        frame: str | None = None,
        channels: str | None = None,
        timeout: float = 0.5,
        relative: bool = False,
        unsupervised: bool = False,
        allow_code: bool = False,
    ):
        for name, number in (("target_system", target_system), ("target_component", target_component)):
            if not 1 <= number <= 255:
                raise BadInput(name, "be from 1 to 255", number)
        checks.positive("timeout", timeout, "s")
        self.timeout = float(timeout)
        self._reader = OdometryReader(source)
        self._target = MavlinkTarget(target_system, target_component)
        text = read_for_link(Path(scenario), allow_code=allow_code, unsupervised=unsupervised)
        self.autopilot = Autopilot(text, attitude="quaternion", log_later=True)
        self._driver = ThrusterDriver(self.autopilot, output, self._target, frame, channels)
        self.channels = self._driver.channels
        self.counts = dict.fromkeys(_COUNTS, 0)
        self.complaint = ""
        self._last: MavlinkOdometry | None = None  # that was used
        self._placed: MavlinkOdometry | None = None  # the last one with a pose
        self._sent_heartbeat = -np.inf
        self._clock = SenderClock(self.timeout)
        self._permission = Permission(target_system)
        self._requests = MessageRequests(source, self._target, self.autopilot.sampling_time)
        self._relative, self._origin = relative, np.zeros(3)  # m, from which positions of the law count

    def is_from_target(self, message: Any) -> bool:
        """Whether a message comes from the vehicle's autopilot."""
        return (message.get_srcSystem(), message.get_srcComponent()) == self._target

    def receive(self, message: Any, now: float) -> LinkMeasurement | None:
        """The measurement that a message brings; None where it brings none that can be used.

        Args:
            message: of pymavlink.
            now: time of a clock that never jumps, s.
        """
        if not self.is_from_target(message):
            self.counts["foreign"] += 1
            return None
        if message.get_type() == "HEARTBEAT":
            if not self._permission.is_present(now):
                self._requests.begin_again()
            self._permission.note(message, now)
        self._requests.note(message, now)
        if message.get_type() == "COMMAND_ACK":
            self._note_acknowledgement(message)
        try:
            odometry = self._reader.read(message)
        except BadInput as error:
            self.counts["invalid"] += 1
            self.complaint = str(error)
            return None
        return None if odometry is None else self._measurement(odometry, now)

    def due(self, now: float) -> list[Any]:
        """Messages that are due without one having come: our heartbeat and requests; call it often."""
        messages: list[Any] = []
        if now - self._sent_heartbeat >= HEARTBEAT_PERIOD:
            self._sent_heartbeat = now
            kind, none = mavlink.MAV_TYPE_ONBOARD_CONTROLLER, mavlink.MAV_AUTOPILOT_INVALID
            messages.append(mavlink.MAVLink_heartbeat_message(kind, none, 0, 0, mavlink.MAV_STATE_ACTIVE, 3))
        if self._permission.is_present(now):
            messages += self._requests.due(now)
        return messages

    def objection(self, now: float) -> str:
        """Why the vehicle or its pilot lets no controller run; "" where one may."""
        return self._permission.why_not(now)

    def note_begin(self) -> None:
        """The controller begins: in the flight mode that the vehicle has now."""
        self._permission.begin()

    def commands(self, volts: np.ndarray, stamp: int = 0) -> list[Any]:
        """Commands to the thrusters for the volts of a controller; `stamp` (ns) is of the measurement they answer."""
        return self._driver.commands(volts, stamp // _MICROSECOND)

    def neutral(self) -> list[Any]:
        """Commands that stop all thrusters."""
        return self._driver.neutral()

    def complaints(self) -> list[str]:
        """What the operator should know: messages that the vehicle refuses to send, and the last complaint."""
        return [words for words in (self._requests.complaint(), self.complaint) if words]

    @property
    def armed(self) -> bool:
        """Whether the vehicle is, as far as is known."""
        return self._permission.armed

    def _note_acknowledgement(self, message: Any) -> None:
        ours = message.command in (mavlink.MAV_CMD_DO_SET_SERVO, mavlink.MAV_CMD_DO_SET_ACTUATOR)
        if ours and message.result != mavlink.MAV_RESULT_ACCEPTED:
            self.counts["rejected commands"] += 1
            result = mavlink.enums["MAV_RESULT"].get(message.result)
            self.complaint = f"command {message.command} was answered {result.name if result else message.result}"

    def _measurement(self, odometry: MavlinkOdometry, now: float) -> LinkMeasurement | None:
        """The measurement of an odometry; None of one that is not of the present."""
        jumps = self._clock.jumps
        objection = self._clock.objection(odometry.time_usec / 1e6, now)
        self.counts["clock jumps"] = self._clock.jumps
        if objection:
            self.counts[objection] += 1
            return None
        before = self._last
        self._last = odometry
        was_reset = before is not None and odometry.resets != before.resets
        if was_reset:
            self._note_reset(odometry)
        elif self._has_leapt(odometry):
            self.counts["leaps"] += 1
            self._permission.note_leap()
        if odometry.has_pose:
            self._placed = odometry
            if self._relative and not self._permission.begun:
                self._origin = _HORIZONTAL * odometry.position
        return LinkMeasurement(
            odometry.position - self._origin,
            odometry.velocity,
            odometry.attitude,
            applied=self._driver.applied,
            elapsed=0.0 if was_reset or self._clock.jumps > jumps else None,
            stamp=odometry.time_usec * _MICROSECOND,
        )

    def _note_reset(self, odometry: MavlinkOdometry) -> None:
        """The estimator has jumped, and with it the place from which a relative target counts."""
        self.counts["estimator resets"] += 1
        if self._relative and self._placed is not None and odometry.has_pose:
            self._origin = self._origin + _HORIZONTAL * (odometry.position - self._placed.position)

    def _has_leapt(self, odometry: MavlinkOdometry) -> bool:
        """Whether no vehicle moves so far from its last position in that time; false without one."""
        before = self._placed
        if before is None or not odometry.has_pose:
            return False
        away = float(np.linalg.norm(odometry.position - before.position))
        return away > LEAP + SPEED * abs(odometry.time_usec - before.time_usec) / 1e6
