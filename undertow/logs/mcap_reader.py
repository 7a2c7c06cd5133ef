"""Reads MCAP files with JSON messages: those of undertow as they were, those of others as tables.

A file that ends early, as after `kill -9`, is read up to there.
"""

import dataclasses
import io
import json
import struct
from collections.abc import Collection, Iterator, Mapping
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from undertow.core.errors import BadInput
from undertow.logs.log import Log
from undertow.logs.mcap_writer import METADATA
from undertow.logs.messages import is_ours, number, signals_of
from undertow.logs.recording import Recording, Table

_LARGEST = 2**28  # bytes of a record; none of ours comes near
_LARGEST_CHUNK = 2**26  # bytes of an unpacked chunk: small files can be made that unpack to any size

_HEAD = struct.Struct("<BQ")  # of a record: its kind, and the bytes that follow
_DATA_END, _IN_CHUNKS = 0x0F, (0x03, 0x04, 0x05)  # kinds; chunks hold schemas, channels and messages


class _Contents(NamedTuple):
    """Messages of a file by topic."""

    messages: dict[str, list[tuple[int, Any]]]  # time in ns, and what the JSON says
    schemas: dict[str, tuple[str, Any]]  # name and what it says, by topic
    facts: dict[str, str]
    encodings: set[str]
    notes: tuple[str, ...]


def has_ros_messages(path: Path) -> bool:
    """Whether the first channel of a file has messages of ROS 2.

    Raises:
        BadInput: damaged before it.
    """
    for record in _records(path, []):
        if type(record).__name__ == "Channel":
            return record.message_encoding == "cdr"
    return False


def read_mcap(path: Path) -> Log | Recording:
    """What a file holds: a log where it is one of undertow, otherwise tables, one per topic.

    Raises:
        BadInput: damaged, or without messages in JSON.
    """
    found = _contents(path)
    others = found.encodings - {"json"}
    if not found.messages:
        got = f"whose messages are {', '.join(sorted(others))}" if others else "which has none"
        if found.notes:
            got = f"{got} before it ends: {found.notes[-1]}"
        raise BadInput("log", "have messages in JSON", f"{path.name}, {got}")
    ours = {topic: messages for topic, messages in found.messages.items() if is_ours(found.schemas[topic][0])}
    if ours:
        return _our_log(path, found, ours)
    notes = (*found.notes, *(f"channels in {one} are left out" for one in sorted(others)))
    tables = {topic: _table(messages, found.schemas[topic][0]) for topic, messages in found.messages.items()}
    return Recording(tables, path.name, "MCAP", notes)


def _our_log(path: Path, found: _Contents, ours: Mapping[str, list[tuple[int, Any]]]) -> Log:
    facts, signals = dict(found.facts), {}
    for topic, messages in ours.items():
        try:
            signals |= signals_of(found.schemas[topic][1], [message for _, message in messages])
        except (KeyError, TypeError, ValueError, AttributeError, OverflowError) as error:
            raise _damaged(path, f"messages of {topic}: {error}") from None
    kept = tuple(filter(None, facts.pop("notes", "").split("\n")))
    facts.pop("source", "")
    return Log(signals, path.name, facts.pop("format", "undertow"), (*kept, *found.notes), facts)


def _table(messages: list[tuple[int, Any]], kind: str) -> Table:
    """Numbers of all messages of a topic; NaN where a message lacks one."""
    rows = [dict(_leaves(message, "")) for _, message in messages]
    names = dict.fromkeys(name for row in rows for name in row)
    time = np.array([stamp for stamp, _ in messages], dtype=np.int64)
    fields = {name: np.array([row.get(name, np.nan) for row in rows]) for name in names}
    return Table(time * 1e-9, fields, kind)


def _leaves(value: Any, path: str) -> Iterator[tuple[str, float]]:
    """Numbers within a message, by path: `pose.position.x`, `values[3]`."""
    if isinstance(value, dict):
        for key, one in value.items():
            yield from _leaves(one, f"{path}.{key}".lstrip("."))
    elif isinstance(value, list):
        for i, one in enumerate(value):
            yield from _leaves(one, f"{path}[{i}]")
    elif isinstance(value, bool | int | float) or value is None:
        yield path, number(value)


def _contents(path: Path) -> _Contents:
    notes: list[str] = []
    schemas, channels, facts = {}, {}, {}
    messages: dict[str, list[tuple[int, Any]]] = {}
    encodings: set[str] = set()
    for record in _records(path, notes):
        kind = type(record).__name__
        if kind == "Schema":
            schemas[record.id] = record
        elif kind == "Channel":
            channels[record.id] = record
            encodings.add(record.message_encoding)
        elif kind == "Metadata" and record.name == METADATA:
            facts |= record.metadata
        elif kind == "Message":
            channel = channels.get(record.channel_id)
            if channel is None:
                raise _damaged(path, f"a message of channel {record.channel_id}, which is not declared")
            if channel.message_encoding == "json":
                messages.setdefault(channel.topic, []).append((record.log_time, _parsed(path, record.data)))
    described = {}
    for channel in channels.values():
        schema = schemas.get(channel.schema_id)
        text = _parsed(path, schema.data) if schema is not None and schema.encoding == "jsonschema" else {}
        described[channel.topic] = (schema.name if schema is not None else "", text)
    return _Contents(messages, described, facts, encodings, tuple(notes))


def _parsed(path: Path, data: bytes) -> Any:
    try:
        return json.loads(data)
    except (ValueError, RecursionError) as error:
        raise _damaged(path, f"a message is no JSON: {error}") from None


def _records(path: Path, notes: list[str]) -> Iterator[Any]:
    """Records of the data section. A file that ends early gives those that are whole, and a note."""
    from mcap.stream_reader import StreamReader

    data = path.read_bytes()
    size, stream = len(data), io.BytesIO(_without_zeros(path, data))
    end = stream.getbuffer().nbytes
    reader = StreamReader(stream, emit_chunks=True, validate_crcs=True, record_size_limit=_LARGEST)
    records = iter(reader.records)
    place = 0  # of the record that is read next
    while True:
        try:
            record = next(records, None)
            parts = _broken_up(record) if type(record).__name__ == "Chunk" else [record]
        except Exception as error:  # whatever bytes may cause
            if place and stream.tell() >= end:
                notes.append(f"the file ends early, within the record at byte {place} of {size}")
                return
            raise _damaged(path, f"at byte {place}: {str(error) or type(error).__name__}") from None
        if record is None or type(record).__name__ == "DataEnd":
            return
        place = stream.tell()
        yield from parts


def _without_zeros(path: Path, data: bytes) -> bytes:
    """The bytes of a file without zeros at its end, which a failure of power leaves there.

    Raises:
        BadInput: zeros elsewhere, where a record should begin.
    """
    at = _first_other(data, 8, range(1, 256))  # after the bytes that mark the format
    if data[at:].strip(b"\0") and at < len(data):
        raise _damaged(path, f"at byte {at}: a record of kind 0, which there is not")
    return data[:at]


def _first_other(data: bytes, at: int, kinds: Collection[int]) -> int:
    """Place of the first record of another kind, from a place on; the length of the data without one."""
    while at + _HEAD.size <= len(data):
        kind, size = _HEAD.unpack_from(data, at)
        if kind not in kinds:
            return at
        if kind == _DATA_END:
            break
        at += _HEAD.size + size
    return len(data)


def _broken_up(chunk: Any) -> list[Any]:
    """Records of a chunk.

    Raises:
        ValueError: it is too large, or holds what no chunk does.
    """
    from mcap.stream_reader import breakup_chunk

    size = chunk.uncompressed_size
    data = _unpacked(chunk.compression, chunk.data) if size <= _LARGEST_CHUNK else b""
    if max(size, len(data)) > _LARGEST_CHUNK:
        raise ValueError(f"a chunk of {max(size, len(data))} bytes, more than the {_LARGEST_CHUNK} that are read")
    other = _first_other(data, 0, _IN_CHUNKS)
    if other < len(data):
        raise ValueError(f"a record of kind {data[other]} in a chunk, where there is none of it")
    return breakup_chunk(dataclasses.replace(chunk, compression="", data=data), validate_crc=True)


def _unpacked(compression: str, data: bytes) -> bytes:
    """The data of a chunk, or a little more of it than is read. The size that the file declares may be a lie."""
    if compression == "zstd":
        import zstandard

        return zstandard.ZstdDecompressor().stream_reader(data).read(_LARGEST_CHUNK + 1)
    if compression == "lz4":
        import lz4.frame

        return lz4.frame.LZ4FrameDecompressor().decompress(data, max_length=_LARGEST_CHUNK + 1)
    return data


def _damaged(path: Path, what: str) -> BadInput:
    return BadInput("log", "be an undamaged MCAP file", f"{path.name}: {what}")
