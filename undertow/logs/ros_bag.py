"""Tables of the numbers in a bag of ROS 1 or ROS 2. Messages are decoded by rosbags."""

from collections.abc import Collection, Iterator
from pathlib import Path
from typing import Any

import numpy as np

from undertow.core.errors import BadInput
from undertow.logs.bag_messages import StoredMessage, stored_messages
from undertow.logs.extra import check_installed, quiet, reason_of
from undertow.logs.message_fields import MessageFields
from undertow.logs.recording import Recording
from undertow.logs.ros1_messages import ROS1_SUFFIXES, ros1_messages
from undertow.logs.ros_types import Decoder

_LONGEST = 64  # numbers of an array that become columns; images and point clouds have more


def read_ros_bag(path: Path, names: Collection[str] = ("",)) -> Recording:
    """Tables of the numbers of each topic, by path: `pose.pose.position.x`, `data[3]`.

    Times are those of the header where a message has a stamp, otherwise those of recording; both since the first.

    Args:
        path: of the bag.
        names: topics and types of which all messages are read; "" for all. Of others, the first message alone is read.

    Raises:
        BadInput: damaged, no message that can be decoded, or rosbags is not installed.
    """
    check_installed("rosbags", "rosbags")
    notes: list[str] = []
    topics = _Topics(names)
    is_ros1 = path.suffix.lower() in ROS1_SUFFIXES
    messages_of, ros = (ros1_messages, "ROS 1") if is_ros1 else (stored_messages, "ROS 2")
    try:
        with quiet(notes):
            for message in messages_of(path, topics.requested, notes):
                topics.add(message)
    except BadInput:
        raise
    except Exception as error:  # whatever bytes may cause
        got = f"{path.name}, {topics.place}: {reason_of(error)}"
        raise BadInput("log", f"be an undamaged bag of {ros}", got) from None
    left_out = topics.left_out()
    notes += [f"{topic} is left out: {reason}" for topic, reason in left_out.items()]
    notes += topics.partly()
    if not topics.fields:
        reasons = "; ".join(f"{topic}: {reason}" for topic, reason in left_out.items())
        got = f"{path.name}, which has {'; '.join([reasons or 'none', *notes])}"
        raise BadInput("log", "have messages that can be decoded", got)
    start = topics.start()
    tables = {topic: fields.table(start) for topic, fields in topics.fields.items()}
    return Recording(tables, path.name, f"{ros} bag", tuple(notes), left_out=left_out)


class _Topics:
    """Numbers of the messages by topic, and what could not be decoded.

    Args:
        names: as above.

    Attributes:
        fields: of each topic.
        place: of the message that was read last, in words.
    """

    def __init__(self, names: Collection[str]):
        self.fields: dict[str, MessageFields] = {}
        self.place = "at its beginning"
        self._names = names
        self._decoder = Decoder()
        self._errors: dict[str, list[str]] = {}  # of each topic and type

    def requested(self, topic: str, kind: str) -> bool:
        """Whether all messages of a topic are to be read, not only the first."""
        return "" in self._names or topic in self._names or kind in self._names

    def add(self, message: StoredMessage) -> None:
        """Add a message, or what is wrong with it."""
        self.place = f"at the message of {message.topic} at {message.recorded} ns"
        first = message.topic not in self.fields and message.topic not in self._errors
        if not first and not self.requested(message.topic, message.kind):
            return
        try:
            decoded = self._decoder.decoded(message.data, message.kind, message.definition)
            fields = self.fields.get(message.topic) or MessageFields(message.kind)
            fields.add(_stamp(decoded) or message.recorded, message.recorded, _leaves(decoded, ""))
        except (ValueError, OverflowError) as error:
            self._errors.setdefault(message.topic, []).append(str(error))
        else:
            self.fields[message.topic] = fields

    def left_out(self) -> dict[str, str]:
        """Reason by topic, of those without a message that could be decoded."""
        return {topic: errors[0] for topic, errors in self._errors.items() if topic not in self.fields}

    def partly(self) -> list[str]:
        """A sentence for each topic of which some messages could not be decoded."""
        return [
            f"{len(errors)} messages of {topic} are left out, the first because {errors[0]}"
            for topic, errors in self._errors.items()
            if topic in self.fields
        ]

    def start(self) -> int:
        """Time of the first message of the requested topics, or of any if none is, ns."""
        stamps = {topic: min(fields.stamps) for topic, fields in self.fields.items()}
        requested_stamps = [stamp for topic, stamp in stamps.items() if self.requested(topic, self.fields[topic].kind)]
        return min(requested_stamps or stamps.values())


def _stamp(message: Any) -> int:
    """Time of the header in ns; 0 without one."""
    stamp = getattr(getattr(message, "header", None), "stamp", None)
    return 0 if stamp is None else int(stamp.sec) * 10**9 + int(stamp.nanosec)


def _leaves(value: Any, path: str) -> Iterator[tuple[str, float]]:
    if hasattr(value, "__dataclass_fields__"):
        for name in value.__dataclass_fields__:
            if not name.startswith("__"):
                yield from _leaves(getattr(value, name), f"{path}.{name}".lstrip("."))
    elif isinstance(value, np.ndarray | list):
        for i, element in enumerate(value[:_LONGEST]):
            yield from _leaves(element, f"{path}[{i}]")
    elif isinstance(value, bool | int | float | np.number):
        yield path, float(value)
