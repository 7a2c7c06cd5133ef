"""Packets of ArduPilot's JSON simulator, byte by byte, and a reply as ArduPilot reads it."""

import json

import numpy as np
import pytest

from undertow.core.errors import BadInput
from undertow.outside.ardupilot.packets import ServoPacket, reply
from undertow.outside.stepped_vehicle import VehicleOutputs
from undertow.outside.thruster_channels import channels_from_text

pytestmark = pytest.mark.interop

# Written out by hand from the documented structure: 18458 = 0x481a, 400 Hz = 0x0190, frame 258 = 0x00000102, and pulses
# of 1500 = 0x05dc, 1900 = 0x076c, 1100 = 0x044c, 65535 and 12 times 0; little-endian.
SIXTEEN = bytes.fromhex("1a48900102010000dc056c074c04ffff" + 12 * "0000")
# 29569 = 0x7381, 1200 Hz = 0x04b0, frame 2^32 - 1, 32 pulses of 1000 = 0x03e8.
THIRTY_TWO = bytes.fromhex("8173b004ffffffff" + 32 * "e803")

STATE = VehicleOutputs(
    position=np.array([1.0, -2.0, 0.25]),
    attitude=np.array([0.5, -0.5, 0.5, 0.5]),
    velocity=np.array([0.125, 0.0, -1e-5]),
    body_velocity=np.array([9.0, 9.0, 9.0, 0.01, 0.02, -0.03]),
    specific_force=np.array([0.5, 0.0, -9.75]),
    propellers=np.array([2 * np.pi, -np.pi]),
    battery=np.array([15.5, 12.25]),
)


def test_packets_of_16_and_32_channels():
    assert len(SIXTEEN) == 40 and len(THIRTY_TWO) == 72
    assert ServoPacket.parsed(SIXTEEN) == (400, 258, (1500, 1900, 1100, 65535) + 12 * (0,))
    assert ServoPacket.parsed(THIRTY_TWO) == (1200, 2**32 - 1, 32 * (1000,))


@pytest.mark.parametrize(
    "data, said",
    [
        (b"", "`packet` must begin with 18458 or 29569, but is 0 bytes"),
        (b"\x1a", "but is 1 bytes"),
        (b"\x1b" + SIXTEEN[1:], "`packet` must begin with 18458 or 29569, but is 18459"),
        (SIXTEEN[:-1], "`packet` must have 40 bytes with 18458, but is 39"),
        (SIXTEEN + b"\0", "but is 41"),
        (SIXTEEN[:2] + THIRTY_TWO[2:], "`packet` must have 40 bytes with 18458, but is 72"),
        (THIRTY_TWO[:2] + SIXTEEN[2:], "`packet` must have 72 bytes with 29569, but is 40"),
        (SIXTEEN[:2] + b"\0\0" + SIXTEEN[4:], "`packet` must have a frame rate above zero"),
        (b"\xfd" + 60 * b"\x01", "`packet` must begin with"),  # MAVLink on the wrong port
    ],
)
def test_what_is_no_packet(data, said):
    with pytest.raises(BadInput, match=said):
        ServoPacket.parsed(data)


def test_a_reply_byte_by_byte():
    """Motor speeds by channel: thruster 1 on channel 2, thruster 2 the other way round on channel 1."""
    expected = (
        b'\n{"timestamp":2.5,"imu":{"gyro":[0.01,0.02,-0.03],"accel_body":[0.5,0.0,-9.75]},'
        b'"position":[1.0,-2.0,3.25],"quaternion":[0.5,-0.5,0.5,0.5],"velocity":[0.125,0.0,-1e-05],'
        b'"battery":{"voltage":15.5,"current":12.25},"rpm":{"rpm_1":30.0,"rpm_2":60.0}}\n'
    )
    assert reply(2.5, STATE, channels_from_text("2,-1", 2), depth=3.0) == expected


def test_what_the_scenario_lacks_is_left_out():
    without = STATE._replace(propellers=(), battery=())
    found = json.loads(reply(2.5, without, channels_from_text("1,2", 2)))
    assert set(found) == {"timestamp", "imu", "position", "quaternion", "velocity"}
