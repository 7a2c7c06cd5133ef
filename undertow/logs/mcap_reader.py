"""Reads MCAP files with JSON messages: those of undertow as they were, those of others as tables.

A file that ends early, as after `kill -9`, is read up to there.
"""

import dataclasses
import io
import json
import struct
from collections.abc import Collection, Iterator
from pathlib import Path
from typing import Any, NamedTuple

from undertow.core.errors import BadInput
from undertow.core.unpacked_size import most_unpacked
from undertow.logs.log import Log
from undertow.logs.mcap_writer import METADATA
from undertow.logs.message_fields import MessageFields
from undertow.logs.messages import is_ours, number, signals_of
from undertow.logs.recording import Recording
from undertow.logs.unpacking import unpacked_chunk

_LARGEST = 2**28  # bytes of a record; none of ours comes near

_HEAD = struct.Struct("<BQ")  # of a record: its kind, and the bytes that follow
_DATA_END, _IN_CHUNKS = 0x0F, (0x03, 0x04, 0x05)  # kinds; chunks hold schemas, channels and messages


class _Contents(NamedTuple):
    """Messages of a file by topic."""

    ours: dict[str, list[Any]]  # what the JSON says
    others: dict[str, MessageFields]
    left_out: dict[str, str]
    schemas: dict[str, tuple[str, Any]]  # name and what it says, by topic
    facts: dict[str, str]
    encodings: set[str]
    notes: list[str]


def has_ros_messages(path: Path) -> bool:
    """Whether the first channel of a file has messages of ROS 2.

    Raises:
        BadInput: damaged before it.
    """
    for record in records(path, []):
        if type(record).__name__ == "Channel":
            return record.message_encoding == "cdr"
    return False


def read_mcap(path: Path) -> Log | Recording:
    """What a file holds: a log where it is one of undertow, otherwise tables, one per topic.

    Raises:
        BadInput: damaged, or without messages in JSON.
    """
    contents = _contents(path)
    others = contents.encodings - {"json"}
    if not contents.ours and not contents.others:
        got = f"whose messages are {', '.join(sorted(others))}" if others else "which has none"
        if contents.notes:
            got = f"{got} before it ends: {contents.notes[-1]}"
        raise BadInput("log", "have messages in JSON", f"{path.name}, {got}")
    if contents.ours:
        return _our_log(path, contents)
    notes = [*contents.notes, *(f"channels in {encoding} are left out" for encoding in sorted(others))]
    notes += [f"{topic} is left out: {reason}" for topic, reason in contents.left_out.items()]
    tables = {topic: fields.table() for topic, fields in contents.others.items()}
    return Recording(tables, path.name, "MCAP", tuple(notes), left_out=contents.left_out)


def _our_log(path: Path, contents: _Contents) -> Log:
    facts = dict(contents.facts)
    signals = {}
    for topic, messages in contents.ours.items():
        try:
            signals |= signals_of(contents.schemas[topic][1], messages)
        except (KeyError, TypeError, ValueError, AttributeError, OverflowError) as error:
            raise _damaged(path, f"messages of {topic}: {error}") from None
    notes = tuple(filter(None, facts.pop("notes", "").split("\n")))
    facts.pop("source", "")
    return Log(signals, path.name, facts.pop("format", "undertow"), (*notes, *contents.notes), facts)


def _leaves(value: Any, path: str) -> Iterator[tuple[str, float]]:
    """Numbers within a message, by path: `pose.position.x`, `values[3]`."""
    if isinstance(value, dict):
        for key, entry in value.items():
            yield from _leaves(entry, f"{path}.{key}".lstrip("."))
    elif isinstance(value, list):
        for i, entry in enumerate(value):
            yield from _leaves(entry, f"{path}[{i}]")
    elif isinstance(value, bool | int | float) or value is None:
        yield path, number(value)


def _contents(path: Path) -> _Contents:
    contents = _Contents({}, {}, {}, {}, {}, set(), [])
    schemas, channels = {}, {}
    for record in records(path, contents.notes):
        kind = type(record).__name__
        if kind == "Schema":
            schemas[record.id] = record
        elif kind == "Channel":
            channels[record.id] = record
            contents.encodings.add(record.message_encoding)
        elif kind == "Metadata" and record.name == METADATA:
            contents.facts.update(record.metadata)
        elif kind == "Message":
            channel = channels.get(record.channel_id)
            if channel is None:
                raise _damaged(path, f"a message of channel {record.channel_id}, which is not declared")
            if channel.message_encoding == "json" and channel.topic not in contents.left_out:
                schema = schemas.get(channel.schema_id)
                name = schema.name if schema is not None else ""
                _add(contents, channel.topic, name, record.log_time, _parsed(path, record.data))
    for channel in channels.values():
        schema = schemas.get(channel.schema_id)
        text = _parsed(path, schema.data) if schema is not None and schema.encoding == "jsonschema" else {}
        contents.schemas[channel.topic] = (schema.name if schema is not None else "", text)
    return contents


def _add(contents: _Contents, topic: str, schema: str, nanoseconds: int, message: Any) -> None:
    """Add a message to the contents. Those of others are kept as numbers at once, which are smaller."""
    if is_ours(schema):
        contents.ours.setdefault(topic, []).append(message)
        return
    fields = contents.others.setdefault(topic, MessageFields(schema))
    try:
        fields.add(nanoseconds, len(fields.stamps), _leaves(message, ""))
    except (ValueError, OverflowError) as error:
        contents.left_out[topic] = str(error)
        del contents.others[topic]


def _parsed(path: Path, data: bytes) -> Any:
    try:
        return json.loads(data)
    except (ValueError, RecursionError) as error:
        raise _damaged(path, f"a message is no JSON: {error}") from None


def records(path: Path, notes: list[str]) -> Iterator[Any]:
    """Records of the data section of a file, those within chunks as if they stood alone.

    Args:
        path: of the file. One that ends early gives the records that are whole.
        notes: to which a sentence is added where it ends early.

    Raises:
        BadInput: the file is damaged, or unpacks to far more than its size.
    """
    from mcap.stream_reader import StreamReader

    data = path.read_bytes()
    size = len(data)
    stream = io.BytesIO(_without_zeros(path, data))
    unpacked = 0
    most = most_unpacked(size)
    end = stream.getbuffer().nbytes
    reader = StreamReader(stream, emit_chunks=True, validate_crcs=True, record_size_limit=_LARGEST)
    records = iter(reader.records)
    offset = 0  # of the record that is read next
    while True:
        try:
            record = next(records, None)
            parts = _broken_up(record) if type(record).__name__ == "Chunk" else [record]
        except Exception as error:  # whatever bytes may cause
            if offset and stream.tell() >= end:
                notes.append(f"the file ends early, within the record at byte {offset} of {size}")
                return
            raise _damaged(path, f"at byte {offset}: {str(error) or type(error).__name__}") from None
        if record is None or type(record).__name__ == "DataEnd":
            return
        unpacked += getattr(record, "uncompressed_size", 0)
        if unpacked > most:
            reason = f"chunks of {unpacked} bytes in all, more than the {most} that are read of a file of this size"
            raise _damaged(path, f"at byte {offset}: {reason}")
        offset = stream.tell()
        yield from parts


def _without_zeros(path: Path, data: bytes) -> bytes:
    """The bytes of a file without zeros at its end, which a failure of power leaves there.

    Raises:
        BadInput: zeros elsewhere, where a record should begin.
    """
    end = _first_other(data, 8, range(1, 256))  # after the bytes that mark the format
    if data[end:].strip(b"\0") and end < len(data):
        raise _damaged(path, f"at byte {end}: a record of kind 0, which there is not")
    return data[:end]


def _first_other(data: bytes, offset: int, kinds: Collection[int]) -> int:
    """Place of the first record of another kind, from a place on; the length of the data without one."""
    while offset + _HEAD.size <= len(data):
        kind, size = _HEAD.unpack_from(data, offset)
        if kind not in kinds:
            return offset
        if kind == _DATA_END:
            break
        offset += _HEAD.size + size
    return len(data)


def _broken_up(chunk: Any) -> list[Any]:
    """Records of a chunk.

    Raises:
        ValueError: it is too large, or holds what no chunk does.
    """
    from mcap.stream_reader import breakup_chunk

    data = unpacked_chunk(chunk.compression, chunk.data, chunk.uncompressed_size)
    offset = _first_other(data, 0, _IN_CHUNKS)
    if offset < len(data):
        raise ValueError(f"a record of kind {data[offset]} in a chunk, where there is none of it")
    return breakup_chunk(dataclasses.replace(chunk, compression="", data=data), validate_crc=True)


def _damaged(path: Path, what: str) -> BadInput:
    return BadInput("log", "be an undamaged MCAP file", f"{path.name}: {what}")
