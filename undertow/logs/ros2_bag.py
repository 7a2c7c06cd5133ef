"""Reads bags of ROS 2: a folder, or a .db3 or .mcap file of one. Messages are decoded by rosbags."""

import re
import tempfile
from collections.abc import Collection, Iterator
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from undertow.core.errors import BadInput
from undertow.logs.extra import check_installed, quiet, reason_of
from undertow.logs.mcap_reader import records
from undertow.logs.message_fields import MessageFields
from undertow.logs.recording import Recording
from undertow.logs.ros2_types import Decoder, Definition
from undertow.logs.unfinished_bag import whole_files
from undertow.logs.unpacking import unpacked, unpacked_file

_LONGEST = 64  # numbers of an array that become columns; images and point clouds have more

_SUFFIXES = (".mcap", ".db3", ".mcap.zstd", ".db3.zstd")


class _Message(NamedTuple):
    """A message of a bag as it is stored; `recorded` in ns."""

    topic: str
    kind: str
    definition: Definition
    recorded: int
    data: bytes


def read_ros2_bag(path: Path, names: Collection[str] = ("",)) -> Recording:
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
    try:
        with quiet(notes):
            for file in _files(path):
                for message in _messages(file, topics, notes):
                    topics.add(message)
    except BadInput:
        raise
    except Exception as error:  # whatever bytes may cause
        got = f"{path.name}, {topics.place}: {reason_of(error)}"
        raise BadInput("log", "be an undamaged bag of ROS 2", got) from None
    left_out = topics.left_out()
    notes += [f"{topic} is left out: {reason}" for topic, reason in left_out.items()]
    notes += topics.partly()
    if not topics.fields:
        reasons = "; ".join(f"{topic}: {reason}" for topic, reason in left_out.items())
        got = f"{path.name}, which has {reasons or 'none'}"
        raise BadInput("log", "have messages that can be decoded", got)
    start = topics.start()
    tables = {topic: fields.table(start) for topic, fields in topics.fields.items()}
    return Recording(tables, path.name, "ROS 2 bag", tuple(notes), left_out=left_out)


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

    def add(self, message: _Message) -> None:
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


def _files(path: Path) -> Iterator[Path]:
    """Storage files of a bag, unpacked where they are compressed."""
    if path.is_file():
        yield path
        return
    files = [file for file in path.iterdir() if file.name.endswith(_SUFFIXES)]
    if not files:
        raise BadInput("log", f"hold files {', '.join(_SUFFIXES)}", f"{path}, without")
    with tempfile.TemporaryDirectory() as folder:
        for file in sorted(files, key=_number):
            yield unpacked_file(file, Path(folder)) if file.suffix == ".zstd" else file


def _number(file: Path) -> tuple[int, str]:
    """Order of the files of a bag: bag_2.mcap before bag_10.mcap."""
    number = re.search(r"_(\d{1,9})\.", file.name)
    return int(number[1]) if number else -1, file.name


def _messages(file: Path, topics: _Topics, notes: list[str]) -> Iterator[_Message]:
    yield from _of_mcap(file, notes) if file.suffix == ".mcap" else _of_sqlite(file, topics, notes)


def _of_mcap(file: Path, notes: list[str]) -> Iterator[_Message]:
    """Messages in CDR of an MCAP file, in its order."""
    forms = {"ros2msg": "msg", "ros2idl": "idl", "omgidl": "idl"}
    types: dict[int, tuple[str, Definition]] = {}
    channels: dict[int, tuple[str, str, Definition]] = {}
    for record in records(file, notes):
        match type(record).__name__:
            case "Schema":
                text = record.data.decode("utf-8", "replace")
                types[record.id] = record.name, Definition(forms.get(record.encoding, ""), text)
            case "Channel" if record.message_encoding == "cdr":
                channels[record.id] = record.topic, *types.get(record.schema_id, ("", Definition()))
            case "Message" if record.channel_id in channels:
                yield _Message(*channels[record.channel_id], record.log_time, unpacked(record.data))


def _of_sqlite(file: Path, topics: _Topics, notes: list[str]) -> Iterator[_Message]:
    """Messages in CDR of a .db3 file; of topics that are not requested the first one."""
    from rosbags.interfaces import MessageDefinitionFormat
    from rosbags.rosbag2 import Reader

    forms = {MessageDefinitionFormat.MSG: "msg", MessageDefinitionFormat.IDL: "idl"}
    with whole_files(file, notes) as (whole_file,), Reader(whole_file) as reader:
        connections = [
            candidate for candidate in reader.connections if getattr(candidate.ext, "serialization_format", "") == "cdr"
        ]
        requested = [candidate for candidate in connections if topics.requested(candidate.topic, candidate.msgtype)]
        alone = [[candidate] for candidate in connections if candidate not in requested]
        for connections_to_read in (requested, *alone):
            for connection, recorded, data in reader.messages(connections_to_read) if connections_to_read else ():
                definition = Definition(forms.get(connection.msgdef.format, ""), connection.msgdef.data)
                yield _Message(connection.topic, connection.msgtype, definition, recorded, unpacked(bytes(data)))
                if connections_to_read is not requested:
                    break


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
