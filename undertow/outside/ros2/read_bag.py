"""Poses, velocities, wrenches and thruster commands of a rosbag2, in this package's axes."""

import warnings
from collections.abc import Callable, Iterable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from undertow.core.errors import BadInput
from undertow.logs.bag_messages import StoredMessage, stored_messages
from undertow.logs.ros_types import Decoder
from undertow.outside.ros2.frames import between_attitudes, between_frd_and_flu
from undertow.outside.ros2.from_messages import SECOND, Frames, motion_of, target_of, wrench_from

# Frames whose axes are east, north, up by REP 105 or by habit.
_ANY_WORLD = Frames(("odom", "map", "world", "earth"))

Series = tuple[NDArray, NDArray]  # times, s; values, a row each


def read_rosbag2(
    path: str | Path, topics: Iterable[str] | None = None, frames: Frames = _ANY_WORLD
) -> dict[str, Series]:
    """Poses, velocities, wrenches and arrays of a rosbag2, in this package's axes and SI units.

    Args:
        path: folder of the bag, or a file of one, of either storage.
        topics: those that are read; None for all of the types below.
        frames: names of the frames whose axes are those of REP 103. Messages in another frame, and others that cannot
            be used, are left out, with a warning. Readings of an IMU are in the axes of its own frame.

    Returns:
        Name -> (times, s, at which the bag has it; values, a row each). Odometry /t gives `/t/position` (north, east,
        down), `/t/quaternion` (w, x, y, z, body -> world) and `/t/velocity` (u, v, w, p, q, r); PoseStamped
        `/t/pose` (north, east, down, roll, pitch, yaw); WrenchStamped `/t/wrench` (body axes); Imu `/t/quaternion`,
        `/t/rates` and `/t/specific_force` (body axes); Float64MultiArray `/t`.

    Raises:
        BadInput: no bag is there, it is damaged, or has none of the topics.
    """
    only = None if topics is None else set(topics)
    rows: dict[str, list[tuple[float, NDArray]]] = {}
    refused: dict[str, list[Exception]] = {}
    decoder = Decoder()
    for topic, kind, definition, nanoseconds, data in _messages(Path(path), only):
        try:
            message = decoder.decoded(data, kind, definition)
            values_by_name = _READERS[kind](message, frames, topic)
        except (BadInput, ValueError) as error:
            refused.setdefault(topic, []).append(error)
            continue
        for name, value in values_by_name.items():
            rows.setdefault(topic + name, []).append((nanoseconds / SECOND, value))
    for topic, errors in refused.items():
        warnings.warn(f"Left out: {len(errors)} messages of {topic}. The first: {errors[0]}", stacklevel=2)
    if not rows:
        topics_or_types = "of " + ", ".join(sorted(only)) if only else f"of the types {', '.join(_READERS)}"
        raise BadInput(str(path), f"have messages that can be used {topics_or_types}", "without")
    return {name: _series(name, samples) for name, samples in rows.items()}


def _messages(path: Path, only: set[str] | None) -> Iterator[StoredMessage]:
    """Messages of known types, of all topics or of some."""
    notes: list[str] = []
    requested = lambda topic, kind: kind in _READERS and (only is None or topic in only)
    try:
        for message in stored_messages(path, requested, notes):
            if requested(message.topic, message.kind):
                yield message
    except (BadInput, OSError):
        raise
    except Exception as error:  # whatever rosbags, SQLite, YAML or zstd say of damaged bytes
        raise BadInput(
            str(path), "be a rosbag2", f"damaged, or something else ({type(error).__name__}: {error})"
        ) from None
    if notes:
        warnings.warn(f"{path}: {'; '.join(notes)}", stacklevel=3)


def _series(name: str, rows: list[tuple[float, NDArray]]) -> Series:
    times, values = zip(*rows, strict=True)
    widths = {len(value) for value in values}
    if len(widths) > 1:
        raise BadInput(name, "have arrays of one length", f"{', '.join(map(str, sorted(widths)))} long")
    return np.array(times), np.array(values)


def _odometry(message: Any, frames: Frames, topic: str) -> dict[str, NDArray]:
    motion = motion_of(message, frames, topic)
    return {f"/{name}": value for name, value in motion._asdict().items()}


def _imu(message: Any, frames: Frames, topic: str) -> dict[str, NDArray]:
    orientation = message.orientation
    vector = lambda xyz: between_frd_and_flu([xyz.x, xyz.y, xyz.z])
    return {
        "/quaternion": between_attitudes([orientation.w, orientation.x, orientation.y, orientation.z]),
        "/rates": vector(message.angular_velocity),
        "/specific_force": vector(message.linear_acceleration),
    }


# Type -> what its messages hold, by the end of the name.
_READERS: dict[str, Callable[[Any, Frames, str], dict[str, NDArray]]] = {
    "nav_msgs/msg/Odometry": _odometry,
    "sensor_msgs/msg/Imu": _imu,
    "geometry_msgs/msg/PoseStamped": lambda message, frames, topic: {"/pose": target_of(message, frames, topic)},
    "geometry_msgs/msg/WrenchStamped": lambda message, frames, topic: {"/wrench": wrench_from(message, frames, topic)},
    "std_msgs/msg/Float64MultiArray": lambda message, frames, topic: {"": np.array(message.data, dtype=float)},
}
