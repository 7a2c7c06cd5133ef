"""The ROS 2 messages that the nodes exchange, as CycloneDDS takes them; their bytes are those of ROS 2 (CDR, XCDR1).

Definitions: packages std_msgs, geometry_msgs, nav_msgs, sensor_msgs, builtin_interfaces and rosgraph_msgs of ROS 2
(the same from Humble to Jazzy). A type `pkg/msg/T` has the name `pkg::msg::dds_::T_` on the wire.

The type store of rosbags has the same definitions, from which these classes could be generated at import. They are
written out because a type checker then knows their fields, a reader finds units and axes, and a quaternion begins as
no rotation. Tests compare their bytes and their hashes with those of the type store.
"""

import functools
import importlib.util
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, TypeVar

if importlib.util.find_spec("cyclonedds") is None:
    remedy = "In the folder of undertow, run: pip install -c constraints.txt '.[ros2]'"
    raise ModuleNotFoundError(f"CycloneDDS is not installed. {remedy}", name="cyclonedds")

from cyclonedds.idl import IdlStruct
from cyclonedds.idl.annotations import final
from cyclonedds.idl.types import array, float64, int32, sequence, uint32
from rosbags.typesys import Stores, get_typestore

from undertow.core.errors import BadInput

Message = TypeVar("Message", bound=IdlStruct)

if TYPE_CHECKING:
    Numbers = list[float]
    Matrix3 = list[float]
    Matrix6 = list[float]
    Dimensions = list["MultiArrayDimension"]
else:
    Numbers, Matrix3, Matrix6 = sequence[float64], array[float64, 9], array[float64, 36]


@dataclass
@final
class Time(IdlStruct, typename="builtin_interfaces::msg::dds_::Time_"):
    """An instant, s and ns."""

    sec: int32 = 0
    nanosec: uint32 = 0


@dataclass
@final
class Header(IdlStruct, typename="std_msgs::msg::dds_::Header_"):
    """When and in which frame."""

    stamp: Time = field(default_factory=Time)
    frame_id: str = ""


@dataclass
@final
class Vector3(IdlStruct, typename="geometry_msgs::msg::dds_::Vector3_"):
    """A vector."""

    x: float64 = 0.0
    y: float64 = 0.0
    z: float64 = 0.0


@dataclass
@final
class Point(IdlStruct, typename="geometry_msgs::msg::dds_::Point_"):
    """A position, m."""

    x: float64 = 0.0
    y: float64 = 0.0
    z: float64 = 0.0


@dataclass
@final
class Quaternion(IdlStruct, typename="geometry_msgs::msg::dds_::Quaternion_"):
    """An attitude, body -> world."""

    x: float64 = 0.0
    y: float64 = 0.0
    z: float64 = 0.0
    w: float64 = 1.0


@dataclass
@final
class Pose(IdlStruct, typename="geometry_msgs::msg::dds_::Pose_"):
    """Position and attitude."""

    position: Point = field(default_factory=Point)
    orientation: Quaternion = field(default_factory=Quaternion)


@dataclass
@final
class Twist(IdlStruct, typename="geometry_msgs::msg::dds_::Twist_"):
    """Velocity (m/s) and angular velocity (rad/s)."""

    linear: Vector3 = field(default_factory=Vector3)
    angular: Vector3 = field(default_factory=Vector3)


@dataclass
@final
class Wrench(IdlStruct, typename="geometry_msgs::msg::dds_::Wrench_"):
    """Force (N) and moment (N m)."""

    force: Vector3 = field(default_factory=Vector3)
    torque: Vector3 = field(default_factory=Vector3)


@dataclass
@final
class PoseWithCovariance(IdlStruct, typename="geometry_msgs::msg::dds_::PoseWithCovariance_"):
    """A pose with its covariance by rows; zeros where it is not known."""

    pose: Pose = field(default_factory=Pose)
    covariance: Matrix6 = field(default_factory=lambda: [0.0] * 36)


@dataclass
@final
class TwistWithCovariance(IdlStruct, typename="geometry_msgs::msg::dds_::TwistWithCovariance_"):
    """A velocity with its covariance."""

    twist: Twist = field(default_factory=Twist)
    covariance: Matrix6 = field(default_factory=lambda: [0.0] * 36)


@dataclass
@final
class Odometry(IdlStruct, typename="nav_msgs::msg::dds_::Odometry_"):
    """Pose of `child_frame_id` in the frame of the header; velocity in the axes of `child_frame_id`."""

    header: Header = field(default_factory=Header)
    child_frame_id: str = ""
    pose: PoseWithCovariance = field(default_factory=PoseWithCovariance)
    twist: TwistWithCovariance = field(default_factory=TwistWithCovariance)


@dataclass
@final
class Imu(IdlStruct, typename="sensor_msgs::msg::dds_::Imu_"):
    """Attitude, angular velocity (rad/s) and specific force (m/s^2), in the axes of the frame of the header."""

    header: Header = field(default_factory=Header)
    orientation: Quaternion = field(default_factory=Quaternion)
    orientation_covariance: Matrix3 = field(default_factory=lambda: [0.0] * 9)
    angular_velocity: Vector3 = field(default_factory=Vector3)
    angular_velocity_covariance: Matrix3 = field(default_factory=lambda: [0.0] * 9)
    linear_acceleration: Vector3 = field(default_factory=Vector3)
    linear_acceleration_covariance: Matrix3 = field(default_factory=lambda: [0.0] * 9)


@dataclass
@final
class PoseStamped(IdlStruct, typename="geometry_msgs::msg::dds_::PoseStamped_"):
    """A pose in the frame of the header."""

    header: Header = field(default_factory=Header)
    pose: Pose = field(default_factory=Pose)


@dataclass
@final
class WrenchStamped(IdlStruct, typename="geometry_msgs::msg::dds_::WrenchStamped_"):
    """A wrench in the axes of the frame of the header."""

    header: Header = field(default_factory=Header)
    wrench: Wrench = field(default_factory=Wrench)


@dataclass
@final
class MultiArrayDimension(IdlStruct, typename="std_msgs::msg::dds_::MultiArrayDimension_"):
    """One dimension of an array."""

    label: str = ""
    size: uint32 = 0
    stride: uint32 = 0


if not TYPE_CHECKING:
    Dimensions = sequence[MultiArrayDimension]


@dataclass
@final
class MultiArrayLayout(IdlStruct, typename="std_msgs::msg::dds_::MultiArrayLayout_"):
    """Dimensions of an array."""

    dim: Dimensions = field(default_factory=list)
    data_offset: uint32 = 0


@dataclass
@final
class Float64MultiArray(IdlStruct, typename="std_msgs::msg::dds_::Float64MultiArray_"):
    """Numbers."""

    layout: MultiArrayLayout = field(default_factory=MultiArrayLayout)
    data: Numbers = field(default_factory=list)


@dataclass
@final
class Clock(IdlStruct, typename="rosgraph_msgs::msg::dds_::Clock_"):
    """Simulated time."""

    clock: Time = field(default_factory=Time)


TOP_LEVEL: tuple[type[IdlStruct], ...] = (Odometry, Imu, WrenchStamped, PoseStamped, Float64MultiArray, Clock)


def ros_type(kind: type[IdlStruct]) -> str:
    """Name of a type in ROS 2, such as `nav_msgs/msg/Odometry`."""
    package, middle, _, name = kind.__idl_typename__.split("::")  # pyright: ignore[reportAttributeAccessIssue]
    return f"{package}/{middle}/{name.removesuffix('_')}"


@functools.cache
def typestore() -> Any:
    """Definitions of the messages of ROS 2 Jazzy, by `rosbags`."""
    return get_typestore(Stores.ROS2_JAZZY)


@functools.cache
def type_hash(kind: type[IdlStruct]) -> str:
    """Hash of the definition of a type (REP 2016), which ROS 2 compares."""
    return typestore().hash_rihs01(ros_type(kind))


def decoded(kind: type[Message], data: bytes) -> Message:
    """The message that CDR bytes hold.

    Raises:
        BadInput: the bytes are truncated, or of something else.
    """
    try:
        return kind.deserialize(data)
    except Exception as error:  # of struct, UTF-8, or CycloneDDS's own `Exception`
        got = f"{len(data)} bytes that do not hold one ({error})"
        raise BadInput("message", f"be a {ros_type(kind)}", got) from None
