"""Packets of ArduPilot's JSON simulator: servo pulses in, readings out.

Source: ArduPilot libraries/SITL/examples/JSON/readme.md@045bdf5 and SIM_JSON.h. The packet is a C structure,
little-endian, without padding: magic number (which also tells how many channels follow), frame rate in Hz, frame count,
pulses in us.
"""

import json
import struct
from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np

from undertow.core.errors import BadInput
from undertow.outside.stepped_vehicle import VehicleOutputs
from undertow.outside.thruster_channels import Channels

# Magic number -> channels; the second with SERVO_32_ENABLE = 1.
CHANNELS_OF = {18458: 16, 29569: 32}

_FORMS = {magic: struct.Struct(f"<HHI{channels}H") for magic, channels in CHANNELS_OF.items()}
_PER_MINUTE = 30 / np.pi  # rad/s -> revolutions per minute


class ServoPacket(NamedTuple):
    """What the autopilot sends once per frame."""

    frame_rate: int  # Hz; the physics advances by its inverse
    frame_count: int
    pwm: tuple[int, ...]  # us

    @classmethod
    def parsed(cls, data: bytes) -> "ServoPacket":
        """The packet of a datagram.

        Raises:
            BadInput: it is none, or its frame rate is zero.
        """
        magic = int.from_bytes(data[:2], "little")
        form = _FORMS.get(magic)
        if form is None:
            magic_numbers = " or ".join(map(str, CHANNELS_OF))
            raise BadInput(
                "packet", f"begin with {magic_numbers}", str(magic) if len(data) > 1 else f"{len(data)} bytes"
            )
        if len(data) != form.size:
            raise BadInput("packet", f"have {form.size} bytes with {magic}", str(len(data)))
        _, frame_rate, frame_count, *pwm = form.unpack(data)
        if frame_rate == 0:
            raise BadInput("packet", "have a frame rate above zero", "0 Hz")
        return cls(frame_rate, frame_count, tuple(pwm))


def reply(timestamp: float, state: VehicleOutputs, channels: Channels, depth: float = 0.0) -> bytes:
    """The answer to a packet, between two line ends: ArduPilot takes what stands between the last two.

    There is no space in it: ArduPilot looks for a vector right behind the colon.

    Args:
        timestamp: time of the physics, s.
        state: of the vehicle.
        channels: of its thrusters; `rpm_3` is of the one on channel 3, positive where a pulse above neutral turns it.
        depth: of the scenario's origin below the surface, m.
    """
    north, east, down = state.position.tolist()
    message: dict[str, Any] = {
        "timestamp": timestamp,
        "imu": {"gyro": state.body_velocity[3:].tolist(), "accel_body": state.specific_force.tolist()},
        "position": [north, east, down + depth],
        "quaternion": state.attitude.tolist(),
        "velocity": state.velocity.tolist(),
    }
    if len(state.battery):
        message["battery"] = dict(zip(("voltage", "current"), state.battery.tolist(), strict=True))
    if len(state.propellers):
        speeds = channels.of_outputs(_PER_MINUTE * state.propellers, neutral=0.0)
        message["rpm"] = {f"rpm_{number}": speeds[number] for number in sorted(speeds)}
    return b"\n" + _compact(message) + b"\n"


def _compact(message: Mapping[str, Any]) -> bytes:
    return json.dumps(message, separators=(",", ":"), allow_nan=False).encode("ascii")
