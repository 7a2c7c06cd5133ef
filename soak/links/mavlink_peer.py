"""An autopilot at the other end of `undertow mavlink`."""

import random
import socket
import warnings
from typing import Any

import numpy as np
from pymavlink.dialects.v20 import common as mavlink

from soak.links.peer import AbstractPeer, Measured, damaged
from soak.links.plan import free_port
from soak.links.scenario import SUPPLY
from undertow.outside.autopilot.vehicle import Vehicle
from undertow.outside.mavlink.message_codec import parsed
from undertow.outside.thruster_channels import channels_of_vehicle
from undertow.physics.plants.pulse_input import pulse_driven
from undertow.physics.power.esc import esc

_NEUTRAL, _SPAN = 1500.0, 400.0  # us
_LONGEST = 65535  # bytes
_UNKNOWN = 21 * [float("nan")]  # covariances
_CAMERA = 197  # a component with an odometry of its own


class MavlinkPeer(AbstractPeer):
    """System 1. It keeps the last pulse of each channel, as ArduPilot does with MAV_CMD_DO_SET_SERVO.

    Args:
        vehicle: that is controlled.
        output: `rc_override` or `servo`.
    """

    def __init__(self, vehicle: Vehicle, output: str):
        self._address = "127.0.0.1", free_port()
        self.arguments = ["mavlink", "SCENARIO", "--connect", "udpin:{}:{}".format(*self._address), "--output", output]
        plant = pulse_driven(vehicle.plant, battery_suffices=False)
        self._channels = channels_of_vehicle(np.asarray(plant.thruster_matrix))
        self._dead_band = float((plant.power.esc or esc()).dead_band)
        self._socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._foreign_socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)

    def begin(self, chance: random.Random) -> None:
        self._chance = chance
        self._alive_at = -np.inf
        self._wire = mavlink.MAVLink(None, srcSystem=1, srcComponent=1)
        self._camera = mavlink.MAVLink(None, srcSystem=1, srcComponent=_CAMERA)
        self._pulses = np.full(16, _NEUTRAL)
        self._origin = chance.randint(1_000_000, 10**12)  # us, of the clock of the autopilot
        self._socket.settimeout(0.0)
        try:
            while True:
                self._socket.recv(_LONGEST)
        except OSError:
            pass

    def items(self, measured: Measured, time: float) -> list[Any]:
        messages = [self._odometry(measured, time).pack(self._wire)]
        if time - self._alive_at >= 1.0 or time < self._alive_at:
            self._alive_at = time
            armed = mavlink.MAV_MODE_FLAG_SAFETY_ARMED
            messages.insert(0, mavlink.MAVLink_heartbeat_message(12, 3, armed, 0, 4, 3).pack(self._wire))
        return messages

    def send(self, item: bytes) -> None:
        self._transmit(self._socket, item)

    def garbage(self, like: bytes) -> list[Any]:
        return list(damaged(like, self._chance))

    def other_version(self, measured: Measured, time: float) -> list[Any]:
        heartbeat = mavlink.MAVLink_heartbeat_message(12, 3, 0, 0, 4, 3)
        old = heartbeat.pack(mavlink.MAVLink(None, srcSystem=2, srcComponent=1), force_mavlink1=True)
        enu = self._odometry(measured, time, mavlink.MAV_FRAME_LOCAL_ENU).pack(self._wire)
        return [old, enu, b"\xfc" + enu[1:]]

    def from_another(self, measured: Measured, time: float) -> None:
        away = measured._replace(position=measured.position + 50.0)
        self._transmit(self._socket, self._odometry(away, time).pack(self._camera))
        self._transmit(self._foreign_socket, self._odometry(away, time).pack(self._wire))

    def take(self, longest: float) -> tuple[np.ndarray | None, int]:
        count = 0
        while True:
            self._socket.settimeout(0.0 if count else longest)
            try:
                data = self._socket.recv(_LONGEST)
            except OSError:
                break
            for message in parsed(data):
                count += self._note(message)
        return (self._volts() if count else None), count

    def close(self) -> None:
        self._socket.close()
        self._foreign_socket.close()

    def _note(self, message: Any) -> bool:
        """Take the pulses of a command; whether it was one."""
        kind = message.get_type()
        if kind == "RC_CHANNELS_OVERRIDE":
            channels = np.array([getattr(message, f"chan{n}_raw") for n in range(1, 17)], dtype=float)
            self._pulses = np.where(channels == 65535, self._pulses, channels)
            return True
        if kind == "COMMAND_LONG" and message.command == mavlink.MAV_CMD_DO_SET_SERVO:
            self._pulses[int(message.param1) - 1] = message.param2
            return True
        return False

    def _volts(self) -> np.ndarray:
        steps = self._channels.of_thrusters(self._pulses, _NEUTRAL) - _NEUTRAL
        return np.where(np.abs(steps) > self._dead_band, SUPPLY * steps / _SPAN, 0.0)

    def _odometry(self, measured: Measured, time: float, frame: int = mavlink.MAV_FRAME_LOCAL_NED) -> Any:
        with warnings.catch_warnings(), np.errstate(over="ignore"):
            warnings.simplefilter("ignore")
            numbers: Any = [np.float32(vector).tolist() for vector in measured]
        position, attitude, velocity = numbers
        frames = frame, mavlink.MAV_FRAME_BODY_FRD
        stamp = self._origin + round(1e6 * time)
        make_message: Any = mavlink.MAVLink_odometry_message
        return make_message(stamp, *frames, *position, attitude, *velocity, _UNKNOWN, _UNKNOWN, 0, 3, 0)

    def _transmit(self, by: socket.socket, data: bytes) -> None:
        try:
            by.sendto(data, self._address)
        except OSError:  # the command has ended
            pass
