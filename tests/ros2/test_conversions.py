"""Messages to numbers and back; what a message says wrongly is one line that names the field."""

import numpy as np
import pytest

from undertow.core.errors import BadInput
from undertow.logs.frames import quaternions
from undertow.outside.ros2 import from_messages, to_messages
from undertow.outside.ros2 import messages as ros
from undertow.outside.ros2.frames import between_attitudes
from undertow.outside.ros2.from_messages import Frames, PoseAndVelocity

pytestmark = pytest.mark.interop

FRAMES = Frames()
STAMP = ros.Time(12, 345)
MOTION = PoseAndVelocity(
    np.array([1.0, 2.0, 3.0]), quaternions([0.1, -0.2, 0.3]), np.array([0.1, 0.2, 0.3, 0.4, 0.5, 0.6])
)


def test_odometry_comes_back_as_it_was():
    message = to_messages.odometry_of(MOTION, STAMP, FRAMES)
    assert (message.header.frame_id, message.child_frame_id) == ("odom", "base_link")
    pose, twist = message.pose.pose, message.twist.twist
    assert (pose.position.x, pose.position.y, pose.position.z) == (2.0, 1.0, -3.0)
    assert (twist.linear.x, twist.linear.y, twist.linear.z) == (0.1, -0.2, -0.3)
    assert (twist.angular.x, twist.angular.y, twist.angular.z) == (0.4, -0.5, -0.6)
    found = from_messages.motion_of(message, FRAMES, "/odom")
    np.testing.assert_array_equal(found.position, MOTION.position)
    np.testing.assert_array_equal(found.velocity, MOTION.velocity)
    np.testing.assert_allclose(found.quaternion, MOTION.quaternion, atol=4e-16)
    assert from_messages.nanoseconds_of(message.header.stamp) == 12_000_000_345


def test_an_imu_at_rest_measures_gravity_upwards():
    """The specific force of a vehicle at rest is -g in NED: +9.81 along z of FLU, as REP 145 has it."""
    level = MOTION._replace(quaternion=np.array([1.0, 0, 0, 0]))
    message = to_messages.imu_of(level, [0.0, 0.0, -9.81], STAMP, FRAMES)
    assert (message.linear_acceleration.x, message.linear_acceleration.z) == (0.0, 9.81)
    assert (message.angular_velocity.x, message.angular_velocity.y) == (0.4, -0.5)
    given = message.orientation
    np.testing.assert_array_equal([given.w, given.x, given.y, given.z], between_attitudes(level.quaternion))


def test_target_and_wrench_come_back():
    outputs = np.array([1, -2, 3, 0.1, 0.2, -0.3])
    message = to_messages.target_message(outputs, STAMP, FRAMES)
    np.testing.assert_allclose(from_messages.target_of(message, FRAMES, "/t"), outputs, atol=1e-15)
    wrench = to_messages.wrench_of(outputs, STAMP, FRAMES)
    assert (wrench.wrench.force.y, wrench.wrench.torque.z, wrench.header.frame_id) == (2.0, 0.3, "base_link")
    np.testing.assert_array_equal(from_messages.wrench_from(wrench, FRAMES, "/w"), outputs)


def odometry(**changes):
    message = to_messages.odometry_of(MOTION, STAMP, FRAMES)
    for path, value in changes.items():
        owner, *names = message, *path.split("__")
        for name in names[:-1]:
            owner = getattr(owner, name)
        setattr(owner, names[-1], value)
    return message


@pytest.mark.parametrize(
    "changes, said",
    [
        ({"header__frame_id": "world_ned"}, "`/odom header.frame_id` must be odom or map, but is 'world_ned'"),
        ({"header__frame_id": ""}, "must be odom or map, but is ''"),
        ({"child_frame_id": "base_link_frd"}, "`/odom child_frame_id` must be base_link, but is 'base_link_frd'"),
        ({"pose__pose__orientation": ros.Quaternion(0, 0, 0, 0)}, "`/odom orientation` must be of unit length"),
        ({"pose__pose__orientation": ros.Quaternion(0, 0, 0.6, 1)}, "of length 1.166"),
    ],
)
def test_odometry_that_cannot_be_used(changes, said):
    with pytest.raises(BadInput) as caught:
        from_messages.motion_of(odometry(**changes), FRAMES, "/odom")
    assert said in str(caught.value) and "\n" not in str(caught.value)


def test_numbers_that_are_not_finite_were_not_measured():
    found = from_messages.motion_of(odometry(pose__pose__position=ros.Point(np.nan, 1, np.inf)), FRAMES, "/odom")
    np.testing.assert_array_equal(found.position, [1, np.nan, -np.inf])
    found = from_messages.motion_of(odometry(pose__pose__orientation=ros.Quaternion(np.nan, 0, 0, 1)), FRAMES, "/odom")
    assert np.isnan(found.quaternion).all() and np.isfinite(found.velocity).all()
    target = ros.PoseStamped(ros.Header(STAMP, "map"), ros.PoseMessage(ros.Point(np.nan, 0, 0)))
    with pytest.raises(BadInput, match="`/t pose` must be finite numbers"):
        from_messages.target_of(target, FRAMES, "/t")


@pytest.mark.parametrize(
    "message, said",
    [
        (ros.Float64MultiArray(data=[0.0] * 7), r"`/thrusters data` must have 8 entries, one per thruster, but is 7"),
        (ros.Float64MultiArray(data=[np.nan] * 8), "`/thrusters data` must be finite numbers"),
        (to_messages.thrusters_of([0.0] * 8, "thrusters [N]"), r"must be `thrusters \[V\]`, but is `thrusters \[N\]`"),
    ],
)
def test_commands_that_cannot_be_used(message, said):
    with pytest.raises(BadInput, match=said):
        from_messages.thrusters_from(message, 8, "thrusters [V]", "/thrusters")


def test_a_command_without_label_is_taken_as_it_is():
    data = np.arange(8.0)
    message = ros.Float64MultiArray(data=data.tolist())
    np.testing.assert_array_equal(from_messages.thrusters_from(message, 8, "thrusters [V]", "/thrusters"), data)


def test_times_that_ros_cannot_write():
    assert to_messages.stamp_of(2_147_483_647_999_999_999) == ros.Time(2_147_483_647, 999_999_999)
    for wrong in (-1, 2_147_483_648_000_000_000):
        with pytest.raises(BadInput, match="`time` must be between 0 and"):
            to_messages.stamp_of(wrong)
