"""From ROS messages to numbers in this package's axes and units; what cannot be used is explained in one line.

Messages may be those of CycloneDDS or those of rosbags: their fields have the same names.
"""

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from undertow.core.errors import BadInput
from undertow.logs.frames import attitudes_of_quaternions
from undertow.outside.autopilot.measured_motion import AS_INTEGRATED
from undertow.outside.realtime.plausible_motion import check_plausible
from undertow.outside.ros2.frames import between_attitudes, between_frd_and_flu, between_ned_and_enu

SECOND = 1_000_000_000  # ns

_UNIT = 1e-3  # a quaternion whose square departs from 1 by more was not meant as an attitude


class Frames(NamedTuple):
    """Names of frames, REP 105.

    Attributes:
        world: frames with axes east, north, up; the first is the one of messages that are sent.
        body: frame of the vehicle, axes forward, port, up.
    """

    world: tuple[str, ...] = ("odom", "map")
    body: str = "base_link"

    def check_world(self, topic: str, frame: str) -> None:
        """Check the frame of a pose."""
        if frame not in self.world:
            hint = "Give `--world-frame` the name, if its axes are east, north, up"
            raise BadInput(f"{topic} header.frame_id", f"be {' or '.join(self.world)}", repr(frame), hint=hint)

    def check_body(self, topic: str, field: str, frame: str) -> None:
        """Check the frame of a velocity or a wrench."""
        if frame != self.body:
            hint = "Give `--body-frame` the name, if its axes are forward, port, up and its origin is the vehicle's"
            raise BadInput(f"{topic} {field}", f"be {self.body}", repr(frame), hint=hint)


class PoseAndVelocity(NamedTuple):
    """Motion of a vehicle; arrays may have further axes before the last one.

    Attributes:
        position: north, east, down, m.
        quaternion: w, x, y, z, body -> world.
        velocity: u, v, w, p, q, r in body axes, m/s and rad/s.
    """

    position: NDArray
    quaternion: NDArray
    velocity: NDArray


def nanoseconds_of(stamp: Any) -> int:
    """Time of a stamp, ns."""
    return stamp.sec * SECOND + stamp.nanosec


def motion_of(message: Any, frames: Frames, topic: str) -> PoseAndVelocity:
    """Motion of an odometry message; numbers that are not finite were not measured.

    Raises:
        BadInput: another frame, a quaternion that is not of unit length, or the motion of no vehicle.
    """
    frames.check_world(topic, message.header.frame_id)
    frames.check_body(topic, "child_frame_id", message.child_frame_id)
    pose, twist = message.pose.pose, message.twist.twist
    velocity = np.concatenate([_frd(twist.linear), _frd(twist.angular)])
    position = _ned(pose.position)
    check_plausible(topic, position, velocity)
    return PoseAndVelocity(position, _attitude(pose.orientation, topic), velocity)


def target_of(message: Any, frames: Frames, topic: str) -> NDArray:
    """Outputs (north, east, down, m; roll, pitch, yaw, rad) of a pose message.

    Raises:
        BadInput: another frame, a number that is not finite, or a quaternion that is not of unit length.
    """
    frames.check_world(topic, message.header.frame_id)
    quaternion = _attitude(message.pose.orientation, topic)
    outputs = np.concatenate([_ned(message.pose.position), attitudes_of_quaternions(quaternion[None], "NED", "FRD")[0]])
    if not np.isfinite(outputs).all():
        raise BadInput(f"{topic} pose", "be finite numbers", outputs.tolist())
    return outputs


def wrench_from(message: Any, frames: Frames, topic: str) -> NDArray:
    """Force (N) and moment (N m) in body axes.

    Raises:
        BadInput: another frame.
    """
    frames.check_body(topic, "header.frame_id", message.header.frame_id)
    return np.concatenate([_frd(message.wrench.force), _frd(message.wrench.torque)])


def thruster_label(unit: str) -> str:
    """Label of an array of thruster commands: what its numbers are, with their unit."""
    return f"thrusters [{unit}]"


def thrusters_from(message: Any, count: int, label: str, topic: str) -> NDArray:
    """Numbers of an array message, one per thruster.

    Raises:
        BadInput: another count, another unit, or a number that is not finite.
    """
    if len(message.data) != count:
        raise BadInput(f"{topic} data", f"have {count} entries, one per thruster", f"{len(message.data)} long")
    label_received = message.layout.dim[0].label if message.layout.dim else ""  # which many leave out
    if label_received and label_received != label:
        hint = "Run the controller with `--output input`, or leave the label empty"
        raise BadInput(f"{topic} layout.dim[0].label", f"be `{label}`", f"`{label_received}`", hint=hint)
    values = np.array(message.data, dtype=float)
    if not np.isfinite(values).all():
        raise BadInput(f"{topic} data", "be finite numbers", values.tolist())
    return values


def _frd(vector: Any) -> NDArray:
    return between_frd_and_flu([vector.x, vector.y, vector.z])


def _ned(point: Any) -> NDArray:
    return between_ned_and_enu([point.x, point.y, point.z])


def _attitude(quaternion: Any, topic: str) -> NDArray:
    """The quaternion w, x, y, z of ours; all NaN where one entry is not finite."""
    numbers = np.array([quaternion.w, quaternion.x, quaternion.y, quaternion.z])
    if not np.isfinite(numbers).all():
        return np.full(4, np.nan)
    square = sum(number * number for number in numbers.tolist())
    if not abs(square - 1) < _UNIT:
        must = "be of unit length"
        raise BadInput(f"{topic} orientation", must, f"{numbers.tolist()} (w, x, y, z), of length {square**0.5:.4g}")
    # As it is where it was integrated, so that the bits of a simulation pass.
    return between_attitudes(numbers if abs(square - 1) < AS_INTEGRATED else numbers / square**0.5)
