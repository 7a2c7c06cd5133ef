"""Connections and messages in a bag of ROS 1, format 2.0 (wiki.ros.org/Bags/Format/2.0), as records.

A bag is a row of records: chunks with connections and messages, then an index, which a recording that was killed lacks.
They are read in their order without the index, so that a whole bag, one that ends early and a damaged one are read in
one way. (The reader of rosbags needs the index, believes its sizes, and unpacks chunks to any size.)

The data of a chunk that is not compressed are read as if its records stood alone, so that its size does not matter.
"""

import dataclasses
import mmap
import struct
from collections.abc import Iterator
from typing import NamedTuple

from undertow.core.unpacked_size import most_unpacked
from undertow.logs.extra import reason_of
from undertow.logs.unpacking import LARGEST_CHUNK, begin_of_chunk, unpacked_chunk

MAGIC = b"#ROSBAG V2.0\n"  # with which a bag begins

SIZE, TIME, _PLACE = struct.Struct("<I"), struct.Struct("<II"), struct.Struct("<Q")

# Kinds of records, by the field `op` of their headers; and what else the header of a kind has, of how many bytes.
MESSAGE, _BAG_HEADER, _INDEX, _CHUNK, _CHUNK_INFO, CONNECTION = range(2, 8)
_ANY_SIZE = -1
_NO_KIND = {b"": 0}  # fields that no header has
_FIELDS = {
    MESSAGE: {b"conn": SIZE.size, b"time": TIME.size},
    _BAG_HEADER: {b"index_pos": _PLACE.size},
    _INDEX: {},
    _CHUNK: {b"compression": _ANY_SIZE, b"size": SIZE.size},
    _CHUNK_INFO: {},
    CONNECTION: {b"conn": SIZE.size, b"topic": _ANY_SIZE},
}
_TOO_LONG = "a record is longer than what is left"
_OP = SIZE.pack(4) + b"op="  # of the header of every record
_LARGEST_HEADER = 2**16  # bytes
_LARGEST_BEFORE_OP = 512  # bytes before `op` in which the beginning of a record is looked for after damaged bytes
_MOST_SEARCHES = 2**10  # of a bag; more damage is not worth the time

_Bytes = bytes | mmap.mmap


@dataclasses.dataclass
class BagDamage:
    """What cannot be read of a bag.

    Attributes:
        lost: bytes that belong to no record.
        first: where the first of them are.
        ending: how the file ends; "" where it ends with its index.
        searches: that are left for records behind damaged bytes.
    """

    lost: int = 0
    first: str = ""
    ending: str = ""
    searches: int = _MOST_SEARCHES

    def add(self, lost: int, place: str) -> None:
        """Add bytes that are lost."""
        self.lost += lost
        self.first = self.first or place


class BagRecord(NamedTuple):
    """A record: its kind, the fields of its header, and where its data begin and end in some bytes."""

    kind: int
    fields: dict[bytes, bytes]
    buffer: _Bytes
    begin: int
    end: int

    def data(self) -> bytes:
        """The data of the record."""
        return self.buffer[self.begin : self.end]


def bag_records(data: mmap.mmap, damage: BagDamage) -> Iterator[BagRecord]:
    """Connections and messages of a bag, those within chunks as if they stood alone.

    Args:
        data: of the whole file.
        damage: gets what cannot be read.

    Raises:
        ValueError: the bag is encrypted, or unpacks to far more than its size.
    """
    index = _index(data)
    if index == 0:
        damage.ending = "the recording was not ended, as after a crash: the bag has no index"
    elif index >= len(data):
        damage.ending = f"the file ends early, after {len(data)} bytes"
    unpacked = 0
    for record in _records(data, len(MAGIC), "byte", damage):
        if record.kind == _CHUNK:
            content, damage_of_content = _unpacked(record, damage)
            unpacked += len(content)
            if unpacked > most_unpacked(len(data)):
                most = most_unpacked(len(data))
                raise ValueError(f"chunks of {unpacked} bytes in all, more than the {most} that are read of its size")
            place = f"the chunk at byte {record.begin}, unpacked byte"
            parts = _records(content, 0, place, damage_of_content)
            yield from (part for part in parts if part.kind != _CHUNK)
        else:
            yield record


def _index(data: mmap.mmap) -> int:
    """Where the index begins by the first record of a bag; 0 where it does not say so, as while it is recorded.

    Raises:
        ValueError: the bag is encrypted.
    """
    try:
        record = _record_at(data, len(MAGIC), ends_early=False)
    except ValueError:
        return 0
    if record.fields.get(b"encryptor"):
        raise ValueError("it is encrypted")
    return _PLACE.unpack(record.fields[b"index_pos"])[0] if record.kind == _BAG_HEADER else 0


def _unpacked(chunk: BagRecord, damage: BagDamage) -> tuple[bytes, BagDamage]:
    """The data of a compressed chunk, and what gets the damage in them.

    A chunk within which the file ends gives what can be unpacked; that it ends within a record is no damage then.
    """
    compression = chunk.fields[b"compression"].decode("latin-1")
    is_cut = chunk.end > len(chunk.buffer)
    try:
        if is_cut:
            return begin_of_chunk(compression, chunk.data(), LARGEST_CHUNK), BagDamage()
        return unpacked_chunk(compression, chunk.data(), SIZE.unpack(chunk.fields[b"size"])[0]), damage
    except Exception as error:  # whatever damaged bytes may cause
        if not is_cut:
            damage.add(chunk.end - chunk.begin, f"the chunk at byte {chunk.begin} ({reason_of(error)})")
        return b"", damage


def _records(buffer: _Bytes, begin: int, place: str, damage: BagDamage) -> Iterator[BagRecord]:
    """Connections, messages and compressed chunks in some bytes, of which those that are no records are left out."""
    offset = begin
    record = _record_or_none(buffer, offset, damage)
    while offset < len(buffer):
        following = None if record is None else _record_or_none(buffer, record.end, damage)
        if record is not None and following is None and record.end < len(buffer):
            if _next_record(buffer, record.begin, damage) < record.end:
                record = None  # its size is damaged: it has another record within it
        if record is None:
            next_offset = _next_record(buffer, offset + 1, damage)
            if next_offset < len(buffer) or not damage.ending:
                damage.add(next_offset - offset, f"{place} {offset}")
            offset = next_offset
            record = _record_or_none(buffer, offset, damage)
            continue
        if record.kind in (CONNECTION, MESSAGE) or (record.kind == _CHUNK and record.begin < record.end):
            yield record
        offset = record.end
        record = following


def _record_or_none(buffer: _Bytes, offset: int, damage: BagDamage) -> BagRecord | None:
    """The record at a place; None where there is none."""
    try:
        return _record_at(buffer, offset, ends_early=bool(damage.ending))
    except ValueError:
        return None


def _next_record(buffer: _Bytes, offset: int, damage: BagDamage) -> int:
    """Where the next record begins after damaged bytes; the end of the bytes without one."""
    op = buffer.find(_OP, offset)
    while op >= 0 and damage.searches:
        damage.searches -= 1
        for begin in range(max(offset, op - _LARGEST_BEFORE_OP), op - SIZE.size + 1):
            head_end = begin + SIZE.size + SIZE.unpack_from(buffer, begin)[0]
            if op + len(_OP) <= head_end <= op + _LARGEST_HEADER and _begins(buffer, begin):
                return begin
        op = buffer.find(_OP, op + 1)
    return len(buffer)


def _begins(buffer: _Bytes, offset: int) -> bool:
    """Whether a record begins at a place, and another one behind it if the bytes do not end there."""
    try:
        record = _record_at(buffer, offset, ends_early=False)
        return record.end == len(buffer) or bool(_record_at(buffer, record.end, ends_early=True))
    except ValueError:
        return False


def _record_at(buffer: _Bytes, offset: int, ends_early: bool) -> BagRecord:
    """The record at a place: the size of its header, the header, the size of its data, the data.

    Args:
        buffer: in which it stands.
        offset: its place.
        ends_early: whether the bytes may end within a chunk. The size of a chunk is 0 until it is finished.

    Raises:
        ValueError: there is none, or not all of it.
    """
    head_begin = offset + SIZE.size
    head_end = head_begin + _size_at(buffer, offset)
    begin = head_end + SIZE.size
    end = begin + _size_at(buffer, head_end)
    if head_end - head_begin > _LARGEST_HEADER:
        raise ValueError("no header of a record")
    fields = header_fields(buffer[head_begin:head_end])
    kind = int.from_bytes(fields.get(b"op", b""), "little")
    for name, size in _FIELDS.get(kind, _NO_KIND).items():
        if name not in fields or size not in (_ANY_SIZE, len(fields[name])):
            raise ValueError("no record of a bag")
    if kind == _CHUNK and fields[b"compression"] == b"none":
        return BagRecord(kind, fields, buffer, begin, begin)
    if kind == _CHUNK and ends_early and begin == end:
        end = len(buffer) + 1
    if end > len(buffer) and not (kind == _CHUNK and ends_early):
        raise ValueError(_TOO_LONG)
    return BagRecord(kind, fields, buffer, begin, end)


def header_fields(data: bytes) -> dict[bytes, bytes]:
    """Fields of a header: of each its size, its name, `=` and its value.

    Raises:
        ValueError: it is none.
    """
    fields = {}
    offset = 0
    while offset < len(data):
        begin = offset + SIZE.size
        offset = begin + _size_at(data, offset)
        name, equals, value = data[begin:offset].partition(b"=")
        if not equals or offset > len(data):
            raise ValueError("no header of a record")
        fields[name] = value
    return fields


def _size_at(buffer: _Bytes, offset: int) -> int:
    if offset + SIZE.size > len(buffer):
        raise ValueError(_TOO_LONG)
    return SIZE.unpack_from(buffer, offset)[0]
