"""A vehicle that talks MAVLink by pymavlink's own connection, and moves as the scenario's does."""

import os

os.environ["MAVLINK20"] = "1"  # read when mavutil is imported: ODOMETRY is a message of MAVLink 2

import numpy as np
from pymavlink import mavutil
from pymavlink.dialects.v20 import common as mavlink

COVARIANCE = [float("nan")] + 20 * [0.0]
ARMED = mavlink.MAV_MODE_FLAG_SAFETY_ARMED


class MavlinkVehicle:
    """System 1, an autopilot; `link` is pymavlink's."""

    def __init__(self, place, system=1):
        self.link = mavutil.mavlink_connection(place, source_system=system, source_component=1, dialect="common")

    def __enter__(self):
        return self

    def __exit__(self, *error):
        self.link.close()

    def heartbeat(self, armed=True):
        kind, autopilot = mavlink.MAV_TYPE_SUBMARINE, mavlink.MAV_AUTOPILOT_ARDUPILOTMEGA
        self.link.mav.heartbeat_send(kind, autopilot, ARMED if armed else 0, 0, mavlink.MAV_STATE_ACTIVE)

    def odometry(self, time_usec, state, frames=(mavlink.MAV_FRAME_LOCAL_NED, mavlink.MAV_FRAME_BODY_FRD), resets=0):
        self.link.mav.odometry_send(
            time_usec,
            *frames,
            *state.position,
            list(state.attitude),
            *state.body_velocity,
            COVARIANCE,
            COVARIANCE,
            resets,
        )

    def position_and_attitude(self, time_ms, state):
        rates = state.body_velocity[3:]
        self.link.mav.attitude_quaternion_send(time_ms, *state.attitude, *rates)
        self.link.mav.local_position_ned_send(time_ms, *state.position, *state.velocity)

    def wait(self, kind, timeout=10.0):
        return self.link.recv_match(type=kind, blocking=True, timeout=timeout)

    def pulses(self):
        """Pulses of the eight thrusters in the next RC_CHANNELS_OVERRIDE, which are on reversed channels."""
        message = self.wait("RC_CHANNELS_OVERRIDE")
        assert message is not None, "no command within ten seconds"
        assert message.target_system == 1 and message.target_component == 1
        assert message.chan9_raw == message.chan18_raw == 65535
        return 3000.0 - np.array([getattr(message, f"chan{n}_raw") for n in range(1, 9)])
