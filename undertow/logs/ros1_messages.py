"""Messages of bags of ROS 1 as they are stored."""

import mmap
from collections.abc import Iterator
from pathlib import Path

from undertow.core.errors import BadInput
from undertow.logs.bag_messages import Requested, StoredMessage
from undertow.logs.ros1_records import CONNECTION, MAGIC, SIZE, TIME, BagDamage, BagRecord, bag_records, header_fields
from undertow.logs.ros_types import Definition

ROS1_SUFFIXES = (".bag", ".active")  # a recording that was killed is called dive.bag.active


def ros1_messages(path: Path, requested: Requested, notes: list[str]) -> Iterator[StoredMessage]:
    """Messages of a bag in its order; of topics that are not requested the first one.

    Topics have the absolute names that ROS resolves them to, `/rovio/imu` for `rovio/imu`. Types have the names of
    ROS 2, `nav_msgs/msg/Odometry` for `nav_msgs/Odometry`.

    Args:
        path: of the file.
        requested: which topics are needed whole.
        notes: gets a sentence for what is damaged or cut off.

    Raises:
        BadInput: no bag of this format.
        ValueError: it is encrypted, or too large unpacked.
    """
    connections: dict[int, tuple[str, str, Definition]] = {}
    topics: set[str] = set()
    damage = BagDamage()
    without_connection = 0
    with path.open("rb") as stream:
        if stream.read(len(MAGIC)) != MAGIC:
            raise BadInput("log", "be a bag of ROS 1 in format 2.0", f"{path.name}, which does not begin like one")
        with mmap.mmap(stream.fileno(), 0, access=mmap.ACCESS_READ) as data:
            for record in bag_records(data, damage):
                number = SIZE.unpack(record.fields[b"conn"])[0]
                if record.kind == CONNECTION:
                    connections[number] = _connection(record)
                elif number not in connections:
                    without_connection += 1
                elif connections[number][0] not in topics or requested(*connections[number][:2]):
                    topics.add(connections[number][0])
                    yield StoredMessage(*connections[number], _nanoseconds(record), record.data())
    if damage.ending:
        notes.append(damage.ending)
    if damage.lost:
        notes.append(f"{damage.lost} bytes are damaged, and left out; the first at {damage.first}")
    if without_connection:
        notes.append(f"{without_connection} messages are left out, whose connections the bag does not describe")


def _connection(record: BagRecord) -> tuple[str, str, Definition]:
    """Topic, type and definition of the messages of a connection."""
    try:
        fields = header_fields(record.data())
    except ValueError:
        fields = {}
    topic, kind, definition = (
        text.decode("utf-8", "replace")
        for text in (record.fields[b"topic"], fields.get(b"type", b""), fields.get(b"message_definition", b""))
    )
    package, _, name = kind.rpartition("/")
    return f"/{topic.lstrip('/')}", f"{package}/msg/{name}", Definition("ros1", definition)


def _nanoseconds(message: BagRecord) -> int:
    seconds, nanoseconds = TIME.unpack(message.fields[b"time"])
    return seconds * 10**9 + nanoseconds
