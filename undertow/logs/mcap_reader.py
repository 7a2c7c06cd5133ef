"""Reads MCAP files with JSON messages: those of undertow as they were, those of others as tables.

A file that ends early, as after `kill -9`, is read up to there.
"""

import io
import json
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from undertow.core.errors import BadInput
from undertow.logs.log import Log
from undertow.logs.mcap_writer import METADATA
from undertow.logs.messages import is_ours, number, signals_of
from undertow.logs.recording import Recording, Table

_LARGEST = 2**28  # bytes of a record; none of ours comes near


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
        got = (
            f"{path.name}, whose messages are {', '.join(sorted(others))}" if others else f"{path.name}, which has none"
        )
        raise BadInput("log", "have messages in JSON", got)
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

    stream = io.BytesIO(path.read_bytes())
    size = stream.getbuffer().nbytes
    records = iter(StreamReader(stream, validate_crcs=True, record_size_limit=_LARGEST).records)
    place = 0  # of the record that is read next
    while True:
        try:
            record = next(records, None)
        except Exception as error:  # whatever bytes may cause
            if place and stream.tell() >= size:
                notes.append(f"the file ends early, within the record at byte {place} of {size}")
                return
            raise _damaged(path, f"at byte {place}: {str(error) or type(error).__name__}") from None
        if record is None or type(record).__name__ == "DataEnd":
            return
        place = stream.tell()
        yield record


def _damaged(path: Path, what: str) -> BadInput:
    return BadInput("log", "be an undamaged MCAP file", f"{path.name}: {what}")
