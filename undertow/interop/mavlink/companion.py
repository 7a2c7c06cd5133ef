"""The rules of a MAVLink companion: when the law runs, and what the thrusters get when it does not."""

from pathlib import Path
from typing import Any

import numpy as np
from pymavlink.dialects.v20 import common as mavlink

from undertow.autopilot.autopilot import Autopilot
from undertow.core import checks
from undertow.core.errors import BadInput
from undertow.interop.mavlink.actuator_commands import Target
from undertow.interop.mavlink.message_requests import MessageRequests
from undertow.interop.mavlink.odometry import Odometry, OdometryReader
from undertow.interop.mavlink.odometry_rate import OdometryRate
from undertow.interop.mavlink.permission import Permission
from undertow.interop.mavlink.sender_clock import SenderClock
from undertow.interop.mavlink.thruster_driver import ThrusterDriver
from undertow.realtime.plausible_motion import SPEED
from undertow.scenario.link_scenario import read_for_link

HEARTBEAT_PERIOD = 1.0  # s
NEUTRAL_PERIOD = 0.1  # s between neutral commands while the law is stopped
JUMP = 1.0  # s, longest time between two odometries by which the law advances

LEAP = 1.0  # m by which a position may leap beyond what the largest plausible speed explains

_COUNTS: tuple[str, ...] = ("steps", "starts", "rejected commands")
_COUNTS += ("foreign", "invalid", "superseded", "repeated", "out of order", "old")  # messages that are not used
_COUNTS += ("clock jumps", "estimator resets", "leaps", "irregular")

_HORIZONTAL = np.array([1.0, 1.0, 0.0])


class Companion:
    """A controller that a vehicle's autopilot talks MAVLink with.

    The law runs while all of this holds, and the thrusters are neutral otherwise:

    * HEARTBEAT of the target says that the vehicle is armed, and is no older than 3 s; nothing here arms it;
    * its flight mode is that in which the law first ran since it was armed, and its status is neither emergency nor
      failsafe;
    * valid odometry is no older than `timeout`, and regular, see `odometry_rate`;
    * the position has not leapt since it was armed.

    It begins (again) at the pose of the next whole odometry: reference, law and output start there. It asks the
    autopilot for the messages with the odometry, see `message_requests`. Of a message:

    * from another system or component: ignored (`foreign`);
    * odometry in axes other than NED or FRD, of a failed estimator, or without its attitude: ignored (`invalid`);
    * odometry with entries that are NaN: the law uses what its model expects; without position or attitude it does not
      count as valid;
    * odometry of the same time as the last, or an earlier one: ignored (`repeated`, `out of order`);
    * odometry whose time says that it is older than `timeout`, or of the future: ignored (`old`), unless that goes on
      for 0.5 s: then the clock of the vehicle was set (`clock jumps`);
    * another `reset_counter`: the estimator has jumped (`estimator resets`), and the law begins again;
    * a position further from the last one than any vehicle moves in that time, and by more than 1 m: a leap (`leaps`),
      after which the law runs only when the vehicle has been disarmed and armed again. Its target may be far away now.

    Args:
        scenario: a .yaml file or an earlier run.nc.
        source: of the odometry, `odometry` or `local_position`.
        output: what the commands are, see `actuator_commands`.
        target_system, target_component: ids of the vehicle's autopilot: its heartbeat and its odometry count, and
            commands go to it.
        frame, channels: of the thrusters, see `thruster_channels`.
        timeout: s.
        blend: time constant, s, with which the output turns from neutral into the law's at a start; 0 for at once.
        relative: whether north and east of the reference count from where the law first ran since the vehicle was
            armed; depth and heading never do.
        unsupervised: whether there is no supervisor where the scenario has none.
        allow_code: whether the Python code that an earlier run.nc names may run.

    Attributes:
        counts: what happened so far.
        complaint: why the last message was ignored, or a command was rejected.
        timeout: s.
        running: whether the law runs.
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
        blend: float = 1.0,
        relative: bool = False,
        unsupervised: bool = False,
        allow_code: bool = False,
    ):
        for name, number in (("target_system", target_system), ("target_component", target_component)):
            if not 1 <= number <= 255:
                raise BadInput(name, "be from 1 to 255", number)
        checks.positive("timeout", timeout, "s")
        self.timeout = float(timeout)
        checks.not_negative("blend", blend, "s")
        self._reader, self._target = OdometryReader(source), Target(target_system, target_component)
        smoothly = blend or 1.0  # a start that is given no applied input has no use for it
        text = read_for_link(Path(scenario), allow_code=allow_code, unsupervised=unsupervised)
        self._autopilot = Autopilot(text, attitude="quaternion", blend=smoothly)
        self._from_neutral = bool(blend)
        self._driver = ThrusterDriver(self._autopilot, output, self._target, frame, channels)
        self.channels = self._driver.channels
        self.counts = dict.fromkeys(_COUNTS, 0)
        self.complaint, self.running = "", False
        self._odometry, self._last = -np.inf, None
        self._sent_heartbeat = self._sent_neutral = -np.inf
        self._clock = SenderClock(self.timeout)
        self._placed: Odometry | None = None  # the last one with a position
        self._permission = Permission(target_system)
        self._requests = MessageRequests(source, self._target, self.sampling_time)
        self._rate = OdometryRate(self.sampling_time)
        self._relative, self._origin = relative, np.zeros(3)  # m, from which positions of the law count

    @property
    def sampling_time(self) -> float:
        """Of the law, s."""
        return self._autopilot.sampling_time

    @property
    def steps_counted(self) -> dict[str, int]:
        """Steps since the last start, and those of them that were late, missed or repeated."""
        return self._autopilot.counts

    def is_from_target(self, message: Any) -> bool:
        """Whether a message comes from the vehicle's autopilot."""
        return (message.get_srcSystem(), message.get_srcComponent()) == self._target

    def receive(self, message: Any, now: float) -> list[Any]:
        """Messages to send in answer to one.

        Args:
            message: of pymavlink.
            now: time of a clock that never jumps, s.
        """
        if not self.is_from_target(message):
            self.counts["foreign"] += 1
            return []
        if message.get_type() == "HEARTBEAT":
            if not self._permission.is_present(now):
                self._requests.begin_again()
            self._permission.note(message, now)
            self._stop_if_lost(now)
        self._requests.note(message, now)
        if message.get_type() == "COMMAND_ACK":
            self._note_acknowledgement(message)
        try:
            odometry = self._reader.read(message)
        except BadInput as error:
            self.counts["invalid"] += 1
            self.complaint = str(error)
            return []
        return [] if odometry is None else self._follow(odometry, now)

    def idle(self, now: float) -> list[Any]:
        """Messages that are due without one having come: our heartbeat, requests, neutral commands; call it often."""
        self._stop_if_lost(now)
        found: list[Any] = []
        if now - self._sent_heartbeat >= HEARTBEAT_PERIOD:
            self._sent_heartbeat = now
            kind, none = mavlink.MAV_TYPE_ONBOARD_CONTROLLER, mavlink.MAV_AUTOPILOT_INVALID
            found.append(mavlink.MAVLink_heartbeat_message(kind, none, 0, 0, mavlink.MAV_STATE_ACTIVE, 3))
        if self._permission.is_present(now):
            found += self._requests.due(now)
        stopped = self.counts["starts"] and not self.running
        if stopped and now - self._sent_neutral >= NEUTRAL_PERIOD:
            self._sent_neutral = now
            found += self.neutral()
        return found

    def neutral(self) -> list[Any]:
        """Commands that stop all thrusters, if the law ever ran."""
        return self._driver.neutral() if self.counts["starts"] else []

    def complaints(self) -> list[str]:
        """What the operator should know: messages that the vehicle refuses to send, and the last complaint."""
        return [words for words in (self._requests.complaint(), self.complaint) if words]

    @property
    def armed(self) -> bool:
        """Whether the vehicle is, as far as is known."""
        return self._permission.armed

    def state(self, now: float) -> str:
        """In words, what the companion does or waits for."""
        waiting = "irregular odometry" if self._rate.irregular else "no valid odometry"
        supervision = self._autopilot.supervision if self.running else ""
        running = f"running, {supervision}" if supervision else "running"
        return self._permission.why_not(now) or (running if self.running else waiting)

    def _note_acknowledgement(self, message: Any) -> None:
        ours = message.command in (mavlink.MAV_CMD_DO_SET_SERVO, mavlink.MAV_CMD_DO_SET_ACTUATOR)
        if ours and message.result != mavlink.MAV_RESULT_ACCEPTED:
            self.counts["rejected commands"] += 1
            result = mavlink.enums["MAV_RESULT"].get(message.result)
            self.complaint = f"command {message.command} was answered {result.name if result else message.result}"

    def _stop_if_lost(self, now: float) -> None:
        lost = now - self._odometry > self.timeout or self._rate.irregular
        if self.running and (lost or self._permission.why_not(now)):
            self.running, self._sent_neutral = False, -np.inf

    def _follow(self, odometry: Odometry, now: float) -> list[Any]:
        """One step of the law, if it may run."""
        self._stop_if_lost(now)
        objection = self._clock.objection(odometry.time_usec / 1e6, now)
        self.counts["clock jumps"] = self._clock.jumps
        if objection:
            self.counts[objection] += 1
            return []
        before, self._last = self._last, odometry
        if before is not None:
            self._rate.note((odometry.time_usec - before.time_usec) / 1e6, now)
            self.counts["irregular"] = self._rate.counted
        self._note_jumps(before, odometry, now)
        if odometry.has_pose:
            self._odometry, self._placed = now, odometry
        self._stop_if_lost(now)
        if self._rate.irregular or self._permission.why_not(now) or not (self.running or odometry.is_whole):
            return []
        volts = self._step(before, odometry) if self.running and before is not None else self._start(odometry)
        self.counts["steps"] += 1
        return self._driver.commands(volts, odometry.time_usec)

    def _note_jumps(self, before: Odometry | None, odometry: Odometry, now: float) -> None:
        """Stop where the estimator says that it has jumped, or the position did."""
        if before is not None and odometry.resets != before.resets:
            self.counts["estimator resets"] += 1
            self.running = False
            if self._relative and self._placed is not None and odometry.has_pose:
                self._origin = self._origin + _HORIZONTAL * (odometry.position - self._placed.position)
        elif self._has_leapt(odometry):
            self.counts["leaps"] += 1
            self._permission.note_leap()

    def _start(self, odometry: Odometry) -> np.ndarray:
        """The first step of the law."""
        if self._relative and not self._permission.begun:
            self._origin = _HORIZONTAL * odometry.position
        self.running = True
        self._permission.begin()
        self.counts["starts"] += 1
        still = np.zeros(len(self.channels.numbers)) if self._from_neutral else None
        return self._autopilot.start(*self._motion(odometry), applied=still)

    def _step(self, before: Odometry, odometry: Odometry) -> np.ndarray:
        elapsed = self._elapsed(before, odometry)
        return self._autopilot.step(*self._motion(odometry), applied=self._driver.applied, dt=elapsed)

    def _motion(self, odometry: Odometry) -> tuple[Any, Any, Any]:
        """As the law gets it."""
        return odometry.position - self._origin, odometry.velocity, odometry.attitude

    def _has_leapt(self, odometry: Odometry) -> bool:
        """Whether no vehicle moves so far from its last position in that time; false without one."""
        before = self._placed
        if before is None or not odometry.has_pose:
            return False
        away = float(np.linalg.norm(odometry.position - before.position))
        return away > LEAP + SPEED * abs(odometry.time_usec - before.time_usec) / 1e6

    def _elapsed(self, before: Odometry, odometry: Odometry) -> float | None:
        """s between two odometries; None, which is the sampling time, where the clock was set."""
        elapsed = (odometry.time_usec - before.time_usec) / 1e6
        return elapsed if 0 < elapsed <= JUMP else None
