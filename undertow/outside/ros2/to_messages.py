"""To ROS messages from numbers in this package's axes and units."""

import numpy as np
from numpy.typing import ArrayLike

from undertow.core.errors import BadInput
from undertow.logs.frames import quaternions
from undertow.outside.ros2 import messages as ros
from undertow.outside.ros2.frames import between_attitudes, between_frd_and_flu, between_ned_and_enu
from undertow.outside.ros2.from_messages import SECOND, Frames, PoseAndVelocity


def stamp_of(nanoseconds: int) -> ros.Time:
    """A stamp. A time that ROS cannot write (before 1970, or after 2038) is an error.

    Raises:
        BadInput: as above.
    """
    seconds, remainder = divmod(nanoseconds, SECOND)
    if not 0 <= seconds < 2**31:
        raise BadInput("time", "be between 0 and 2,147,483,647 s", f"{seconds} s")
    return ros.Time(seconds, remainder)


def odometry_of(motion: PoseAndVelocity, stamp: ros.Time, frames: Frames) -> ros.Odometry:
    """Odometry of a motion."""
    twist = ros.TwistMessage(_vector(motion.velocity[:3]), _vector(motion.velocity[3:]))
    return ros.Odometry(
        ros.Header(stamp, frames.world[0]),
        frames.body,
        ros.PoseWithCovariance(_pose(motion.position, motion.quaternion)),
        ros.TwistWithCovariance(twist),
    )


def imu_of(motion: PoseAndVelocity, specific_force: ArrayLike, stamp: ros.Time, frames: Frames) -> ros.Imu:
    """Imu message; the specific force is in body axes (m/s^2), upwards where the vehicle rests."""
    return ros.Imu(
        ros.Header(stamp, frames.body),
        orientation=_pose(motion.position, motion.quaternion).orientation,
        angular_velocity=_vector(motion.velocity[3:]),
        linear_acceleration=_vector(specific_force),
    )


def target_message(outputs: ArrayLike, stamp: ros.Time, frames: Frames) -> ros.PoseStamped:
    """Pose message of outputs (north, east, down, m; roll, pitch, yaw, rad)."""
    outputs = np.asarray(outputs, dtype=float)
    return ros.PoseStamped(ros.Header(stamp, frames.world[0]), _pose(outputs[:3], quaternions(outputs[3:])))


def wrench_of(wrench: ArrayLike, stamp: ros.Time, frames: Frames) -> ros.WrenchStamped:
    """Wrench message of force (N) and moment (N m) in body axes."""
    numbers = np.asarray(wrench, dtype=float)
    return ros.WrenchStamped(ros.Header(stamp, frames.body), ros.Wrench(_vector(numbers[:3]), _vector(numbers[3:])))


def thrusters_of(values: ArrayLike, label: str) -> ros.Float64MultiArray:
    """Array message of one number per thruster; the label says which and in what unit."""
    data = np.asarray(values, dtype=float).tolist()
    layout = ros.MultiArrayLayout([ros.MultiArrayDimension(label, len(data), len(data))])
    return ros.Float64MultiArray(layout, data)


def _vector(frd: ArrayLike) -> ros.Vector3:
    x, y, z = between_frd_and_flu(frd).tolist()
    return ros.Vector3(x, y, z)


def _pose(position: ArrayLike, quaternion: ArrayLike) -> ros.PoseMessage:
    w, x, y, z = between_attitudes(quaternion).tolist()
    east, north, up = between_ned_and_enu(position).tolist()
    return ros.PoseMessage(ros.Point(east, north, up), ros.Quaternion(x, y, z, w))
