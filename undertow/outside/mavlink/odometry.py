"""Measured motion from MAVLink messages: ODOMETRY, or LOCAL_POSITION_NED with ATTITUDE_QUATERNION."""

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from pymavlink.dialects.v20 import common as mavlink

from undertow.core import checks
from undertow.core.errors import BadInput
from undertow.outside.realtime.plausible_motion import check_plausible

# Word of the option -> messages with the odometry.
MESSAGES = {"odometry": ("ODOMETRY",), "local_position": ("ATTITUDE_QUATERNION", "LOCAL_POSITION_NED")}
ODOMETRIES = ("ODOMETRY", "LOCAL_POSITION_NED")  # messages with a position

# Frames of ODOMETRY that are used as they are: axes north, east, down, or forward, starboard, down of some heading.
_WORLD = {mavlink.MAV_FRAME_LOCAL_NED, mavlink.MAV_FRAME_LOCAL_FRD}
_BODY = {mavlink.MAV_FRAME_BODY_FRD}

_FAILED = -1  # quality of an odometry that has failed
_LENGTH = 0.1  # by which a quaternion may miss the length 1
_APART = 0.1  # s, between a position and the attitude that goes with it


class MavlinkOdometry(NamedTuple):
    """Motion at an instant; entries that were not measured are NaN.

    Attributes:
        time_usec: of the sender's clock, us.
        position: north, east, down, m.
        attitude: quaternion w, x, y, z, body -> world.
        velocity: u, v, w, m/s, and p, q, r, rad/s, body axes.
        resets: how often the estimator of the sender has jumped, modulo 256.
    """

    time_usec: int
    position: NDArray
    attitude: NDArray
    velocity: NDArray
    resets: int = 0

    @property
    def has_pose(self) -> bool:
        """Whether position and attitude were measured."""
        return bool(np.isfinite(self.position).all() and np.isfinite(self.attitude).all())

    @property
    def is_whole(self) -> bool:
        """Whether everything was measured."""
        return self.has_pose and bool(np.isfinite(self.velocity).all())


class OdometryReader:
    """Makes odometry from messages, as they come.

    Args:
        source: `odometry`: each message ODOMETRY. `local_position`: each LOCAL_POSITION_NED, with the last
            ATTITUDE_QUATERNION where that is less than 0.1 s older or newer.
    """

    def __init__(self, source: str = "odometry"):
        checks.choice("input", source, tuple(MESSAGES))
        self._source, self._attitude = source, None

    def read(self, message: Any) -> MavlinkOdometry | None:
        """The odometry that a message completes; None for another message, or one that waits for its attitude.

        Raises:
            BadInput: the message is in other axes, its estimator has failed, or its attitude is too old.
        """
        kind = message.get_type()
        if self._source == "odometry":
            return of_odometry(message) if kind == "ODOMETRY" else None
        if kind == "ATTITUDE_QUATERNION":
            self._attitude = message
        if kind != "LOCAL_POSITION_NED" or self._attitude is None:
            return None
        time_between = (message.time_boot_ms - self._attitude.time_boot_ms) / 1e3
        if abs(time_between) > _APART:
            raise BadInput(
                "ATTITUDE_QUATERNION", f"be within {_APART:g} s of LOCAL_POSITION_NED", f"{time_between:g} s apart"
            )
        return of_local_position(message, self._attitude)


def of_odometry(message: Any) -> MavlinkOdometry:
    """Odometry of a message ODOMETRY: pose in the local frame, velocity in body axes.

    Raises:
        BadInput: its axes are others, its estimator has failed, or it is the motion of no vehicle.
    """
    _check_frame("frame_id", message.frame_id, _WORLD)
    _check_frame("child_frame_id", message.child_frame_id, _BODY)
    if message.quality == _FAILED:
        raise BadInput("ODOMETRY.quality", "not be -1, an odometry that has failed", message.quality)
    velocity = [message.vx, message.vy, message.vz, message.rollspeed, message.pitchspeed, message.yawspeed]
    position = np.array([message.x, message.y, message.z], dtype=float)
    attitude = _unit(np.array(message.q, dtype=float))
    check_plausible("ODOMETRY", position, velocity)
    return MavlinkOdometry(
        message.time_usec, position, attitude, np.array(velocity, dtype=float), message.reset_counter
    )


def of_local_position(position: Any, attitude: Any) -> MavlinkOdometry:
    """Odometry of LOCAL_POSITION_NED, whose velocity is in world axes, and ATTITUDE_QUATERNION.

    Raises:
        BadInput: it is the motion of no vehicle.
    """
    quaternion = _unit(np.array([attitude.q1, attitude.q2, attitude.q3, attitude.q4], dtype=float))
    world = np.array([position.vx, position.vy, position.vz], dtype=float)
    rates = np.array([attitude.rollspeed, attitude.pitchspeed, attitude.yawspeed], dtype=float)
    velocity = np.concatenate([in_body_axes(quaternion, world), rates])
    north_east_down = np.array([position.x, position.y, position.z], dtype=float)
    check_plausible("LOCAL_POSITION_NED", north_east_down, velocity)
    return MavlinkOdometry(1000 * position.time_boot_ms, north_east_down, quaternion, velocity)


def in_body_axes(quaternion: NDArray, world: NDArray) -> NDArray:
    """A vector in body axes from one in world axes; the quaternion (w, x, y, z) is body -> world."""
    w = quaternion[0]
    v = -quaternion[1:]
    twice = 2 * np.cross(v, world)
    return world + w * twice + np.cross(v, twice)


def _unit(quaternion: NDArray) -> NDArray:
    """With length 1; NaN where the length is no rounding of 1: there is no attitude in such numbers."""
    length = np.linalg.norm(quaternion)
    return quaternion / length if abs(length - 1) <= _LENGTH else np.full(4, np.nan)


def _check_frame(name: str, frame: int, allowed: set[int]) -> None:
    if frame not in allowed:
        names = " or ".join(mavlink.enums["MAV_FRAME"][number].name for number in sorted(allowed))
        got = mavlink.enums["MAV_FRAME"].get(frame)
        raise BadInput(f"ODOMETRY.{name}", f"be {names}", got.name if got else f"{frame}, which is no frame")
