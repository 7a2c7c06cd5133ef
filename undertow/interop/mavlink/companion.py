"""The rules of a MAVLink companion: when the law runs, and what the thrusters get when it does not."""

from pathlib import Path
from typing import Any

import jax.numpy as jnp
import numpy as np
from pymavlink.dialects.v20 import common as mavlink

from undertow.autopilot.autopilot import Autopilot
from undertow.autopilot.numbers import step_of
from undertow.core import checks, runtime
from undertow.core.contracts import Inputs
from undertow.core.errors import BadInput
from undertow.interop.mavlink.actuator_commands import Pulses, Target, commands_of
from undertow.interop.mavlink.odometry import Odometry, OdometryReader
from undertow.interop.pulse_driven import pulse_driven
from undertow.interop.thruster_channels import channels_of_vehicle
from undertow.plants.hybrid_vehicle import HybridVehicle
from undertow.power.esc import ESC, esc

HEARTBEAT_PERIOD = 1.0  # s
HEARTBEAT_TIMEOUT = 3.0  # s without one from the vehicle, after which the law stops
NEUTRAL_PERIOD = 0.1  # s between neutral commands while the law is stopped
JUMP = 1.0  # s; odometry whose time goes back, or on by more, comes from a clock that was set

_COUNTS = ("steps", "starts", "foreign", "invalid", "repeated", "clock jumps", "estimator resets", "rejected commands")


class Companion:
    """A controller that a vehicle's autopilot talks MAVLink with.

    The law runs while all of this holds, and the thrusters are neutral otherwise:

    * HEARTBEAT of the target system says that the vehicle is armed, and is no older than 3 s; nothing here arms it;
    * valid odometry is no older than `timeout`.

    It begins (again) at the pose of the next whole odometry: reference, law and output start there. Of a message:

    * from another system: ignored (`foreign`);
    * odometry in axes other than NED or FRD, of a failed estimator, or without its attitude: ignored (`invalid`);
    * odometry with entries that are NaN: the law uses what its model expects; without position or attitude it does not
      count as valid;
    * odometry of the same time as the last: ignored (`repeated`);
    * odometry whose time goes back, or on by more than 1 s: its clock was set (`clock jumps`); the law advances by one
      sampling time;
    * another `reset_counter`: the estimator has jumped (`estimator resets`), and the law begins again.

    Args:
        scenario: a .yaml file or an earlier run.nc.
        source: of the odometry, `odometry` or `local_position`.
        output: what the commands are, see `actuator_commands`.
        target_system: system id of the vehicle.
        frame, channels: of the thrusters, see `thruster_channels`.
        timeout: s.
        blend: time constant, s, with which the output turns from neutral into the law's at a start; 0 for at once.
        allow_code: whether the Python code that an earlier run.nc names may run.

    Attributes:
        counts: what happened so far.
        complaint: why the last message was ignored, or a command was rejected.
        timeout: s.
        running: whether the law runs.
        armed: whether the vehicle is, as far as is known.
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
        frame: str | None = None,
        channels: str | None = None,
        timeout: float = 0.5,
        blend: float = 1.0,
        allow_code: bool = False,
    ):
        if not 1 <= target_system <= 255:
            raise BadInput("target_system", "be from 1 to 255", target_system)
        checks.positive("timeout", timeout, "s")
        self.timeout = float(timeout)
        checks.not_negative("blend", blend, "s")
        self._reader, self._target = OdometryReader(source), Target(target_system)
        smoothly = blend or 1.0  # a start that is given no applied input has no use for it
        self._autopilot = Autopilot(scenario, attitude="quaternion", blend=smoothly, allow_code=allow_code)
        plant = pulse_driven(self._autopilot.plant, battery_suffices=False)
        self._esc, self._from_neutral = plant.power.esc or esc(), bool(blend)
        self.channels = channels_of_vehicle(np.asarray(plant.thruster_matrix), frame, channels)
        self._commands = commands_of(output, int(self.channels.numbers.max()))
        with runtime.on_processor(), runtime.in_precision(self._autopilot.precision):
            self._drive = step_of(driven, (plant, self._esc), (), jnp.zeros(plant.inputs()))
        self.counts = dict.fromkeys(_COUNTS, 0)
        self.complaint, self.running, self.armed = "", False, False
        self._heartbeat, self._odometry, self._last = -np.inf, -np.inf, None
        self._sent_heartbeat = self._sent_neutral = -np.inf

    @property
    def sampling_time(self) -> float:
        """Of the law, s."""
        return self._autopilot.sampling_time

    @property
    def steps_counted(self) -> dict[str, int]:
        """Steps since the last start, and those of them that were late, missed or repeated."""
        return self._autopilot.counts

    @property
    def target_system(self) -> int:
        """System id of the vehicle."""
        return self._target.system

    def receive(self, message: Any, now: float) -> list[Any]:
        """Messages to send in answer to one.

        Args:
            message: of pymavlink.
            now: time of a clock that never jumps, s.
        """
        if message.get_srcSystem() != self._target.system:
            self.counts["foreign"] += 1
            return []
        if message.get_type() == "HEARTBEAT":
            self._note_heartbeat(message, now)
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
        """Messages that are due without one having come: our heartbeat, and neutral commands; call it often."""
        self._stop_if_lost(now)
        found: list[Any] = []
        if now - self._sent_heartbeat >= HEARTBEAT_PERIOD:
            self._sent_heartbeat = now
            kind, none = mavlink.MAV_TYPE_ONBOARD_CONTROLLER, mavlink.MAV_AUTOPILOT_INVALID
            found.append(mavlink.MAVLink_heartbeat_message(kind, none, 0, 0, mavlink.MAV_STATE_ACTIVE, 3))
        stopped = self.counts["starts"] and not self.running
        if stopped and now - self._sent_neutral >= NEUTRAL_PERIOD:
            self._sent_neutral = now
            found += self.neutral()
        return found

    def neutral(self) -> list[Any]:
        """Commands that stop all thrusters, if the law ever ran."""
        if not self.counts["starts"]:
            return []
        return self._made(np.full(len(self.channels.numbers), float(self._esc.neutral)), 0)

    def state(self, now: float) -> str:
        """In words, what the companion does or waits for."""
        if now - self._heartbeat > HEARTBEAT_TIMEOUT:
            return f"no heartbeat of system {self._target.system}"
        if not self.armed:
            return "disarmed"
        return "running" if self.running else "no valid odometry"

    def _note_heartbeat(self, message: Any, now: float) -> None:
        """An autopilot's; cameras and the like of the same system say that they are none."""
        if message.autopilot == mavlink.MAV_AUTOPILOT_INVALID:
            return
        self._heartbeat = now
        self.armed = bool(message.base_mode & mavlink.MAV_MODE_FLAG_SAFETY_ARMED)
        self._stop_if_lost(now)

    def _note_acknowledgement(self, message: Any) -> None:
        ours = message.command in (mavlink.MAV_CMD_DO_SET_SERVO, mavlink.MAV_CMD_DO_SET_ACTUATOR)
        if ours and message.result != mavlink.MAV_RESULT_ACCEPTED:
            self.counts["rejected commands"] += 1
            result = mavlink.enums["MAV_RESULT"].get(message.result)
            self.complaint = f"command {message.command} was answered {result.name if result else message.result}"

    def _stop_if_lost(self, now: float) -> None:
        lost = now - self._heartbeat > HEARTBEAT_TIMEOUT or now - self._odometry > self.timeout
        if self.running and (lost or not self.armed):
            self.running, self._sent_neutral = False, -np.inf

    def _follow(self, odometry: Odometry, now: float) -> list[Any]:
        """One step of the law, if it may run."""
        self._stop_if_lost(now)
        before, self._last = self._last, odometry
        if before is not None and odometry.time_usec == before.time_usec:
            self.counts["repeated"] += 1
            return []
        if before is not None and odometry.resets != before.resets:
            self.counts["estimator resets"] += 1
            self.running = False
        if odometry.has_pose:
            self._odometry = now
        if not self.armed or now - self._heartbeat > HEARTBEAT_TIMEOUT:
            return []
        given = odometry.position, odometry.velocity, odometry.attitude
        if not self.running:
            if not odometry.is_whole:
                return []
            self.running = True
            self.counts["starts"] += 1
            still = np.zeros(len(self.channels.numbers)) if self._from_neutral else None
            volts = self._autopilot.start(*given, applied=still)
        else:
            assert before is not None
            volts = self._autopilot.step(*given, applied=self._drive.outputs[1], dt=self._elapsed(before, odometry))
        self.counts["steps"] += 1
        self._drive.inputs[...] = volts
        self._drive()
        return self._made(self._drive.outputs[0], odometry.time_usec)

    def _elapsed(self, before: Odometry, odometry: Odometry) -> float | None:
        """s between two odometries; None, which is the sampling time, where the clock was set."""
        elapsed = (odometry.time_usec - before.time_usec) / 1e6
        if 0 < elapsed <= JUMP:
            return elapsed
        self.counts["clock jumps"] += 1
        return None

    def _made(self, pulses: Any, time_usec: int) -> list[Any]:
        neutral, span = float(self._esc.neutral), float(self._esc.span)
        by_channel = self.channels.of_outputs(pulses, neutral)
        return self._commands(self._target, Pulses(by_channel, neutral, span), time_usec)


def driven(of: tuple[HybridVehicle, ESC], _, volts: Inputs):
    """Pulses, us, for the volts of a law, and the volts that these give, which the law gets as applied."""
    plant, speed_controllers = of
    bus = jnp.asarray(plant.thruster.supply)
    pulses = speed_controllers.pulse(jnp.clip(volts, *plant.thruster.limits()), bus)
    return (), (pulses, speed_controllers.voltage(pulses, bus))
