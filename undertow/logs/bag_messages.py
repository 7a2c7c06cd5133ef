"""Messages of bags of ROS 2 as they are stored: a folder, or a .db3 or .mcap file of one, whole or cut off."""

import re
import tempfile
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import NamedTuple

from undertow.core.errors import BadInput
from undertow.logs.mcap_reader import records
from undertow.logs.ros_types import Definition
from undertow.logs.unfinished_database import consistent_database
from undertow.logs.unpacking import unpacked, unpacked_file

STORAGE_FILES = (".mcap", ".db3")
_SUFFIXES = (*STORAGE_FILES, ".mcap.zstd", ".db3.zstd")

Requested = Callable[[str, str], bool]  # of a topic and its type: whether all of its messages are needed


class StoredMessage(NamedTuple):
    """A message of a bag as it is stored; `recorded` in ns."""

    topic: str
    kind: str
    definition: Definition
    recorded: int
    data: bytes


def stored_messages(path: Path, requested: Requested, notes: list[str]) -> Iterator[StoredMessage]:
    """Messages in CDR of a bag, file by file; of topics that are not requested at least the first one.

    Args:
        path: of the bag.
        requested: which topics are needed whole.
        notes: gets a sentence for what the bag lacks.

    Raises:
        BadInput: a folder without files of a bag.
        Exception: whatever readers say of damaged bytes.
    """
    for file in _files(path, notes):
        yield from _of_mcap(file, notes) if file.suffix == ".mcap" else _of_sqlite(file, requested, notes)


def _files(path: Path, notes: list[str]) -> Iterator[Path]:
    """Storage files of a bag, unpacked where they are compressed."""
    if path.is_file():
        yield path
        return
    files = [file for file in path.iterdir() if file.name.endswith(_SUFFIXES)] if path.is_dir() else []
    if not files:
        raise BadInput("log", f"be a bag of ROS 2, with files {', '.join(_SUFFIXES)}", str(path))
    if not (path / "metadata.yaml").is_file():
        notes.append("the bag has no metadata.yaml: its files are read without")
    with tempfile.TemporaryDirectory() as folder:
        for file in sorted(files, key=_number):
            yield unpacked_file(file, Path(folder)) if file.suffix == ".zstd" else file


def _number(file: Path) -> tuple[int, str]:
    """Order of the files of a bag: bag_2.mcap before bag_10.mcap."""
    number = re.search(r"_(\d{1,9})\.", file.name)
    return int(number[1]) if number else -1, file.name


def _of_mcap(file: Path, notes: list[str]) -> Iterator[StoredMessage]:
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
                yield StoredMessage(*channels[record.channel_id], record.log_time, unpacked(record.data))


def _of_sqlite(file: Path, requested: Requested, notes: list[str]) -> Iterator[StoredMessage]:
    """Messages in CDR of a .db3 file; of topics that are not requested the first one."""
    from rosbags.interfaces import MessageDefinitionFormat
    from rosbags.rosbag2 import Reader

    forms = {MessageDefinitionFormat.MSG: "msg", MessageDefinitionFormat.IDL: "idl"}
    with consistent_database(file, notes) as readable, Reader(readable) as reader:
        connections = [
            candidate for candidate in reader.connections if getattr(candidate.ext, "serialization_format", "") == "cdr"
        ]
        needed = [candidate for candidate in connections if requested(candidate.topic, candidate.msgtype)]
        others = [[candidate] for candidate in connections if candidate not in needed]
        for connections_to_read in (needed, *others):
            for connection, recorded, data in reader.messages(connections_to_read) if connections_to_read else ():
                definition = Definition(forms.get(connection.msgdef.format, ""), connection.msgdef.data)
                yield StoredMessage(connection.topic, connection.msgtype, definition, recorded, unpacked(bytes(data)))
                if connections_to_read is not needed:
                    break
