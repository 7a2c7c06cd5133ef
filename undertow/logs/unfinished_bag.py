"""Bags of ROS 2 whose recording was killed: without metadata.yaml, or without the end of a file.

rosbags reads neither. Nothing in the bag is changed: what it lacks is added to a copy.
"""

import contextlib
import shutil
import sqlite3
import struct
import tempfile
from collections.abc import Iterator
from pathlib import Path

from undertow.core.errors import BadInput

STORAGE_FILES = (".mcap", ".db3")

_MAGIC = b"\x89MCAP0\r\n"
_HEAD = struct.Struct("<BQ")  # of a record of MCAP: its kind, and the bytes that follow
_DATA_END, _FOOTER = 0x0F, 0x02
_LARGEST_KIND = 0x0F

# The end of an MCAP file without an index: readers look through the whole file instead.
END_WITHOUT_INDEX = _HEAD.pack(_DATA_END, 4) + bytes(4) + _HEAD.pack(_FOOTER, 20) + bytes(20) + _MAGIC


@contextlib.contextmanager
def whole_files(bag: Path, notes: list[str]) -> Iterator[list[Path]]:
    """What of a bag rosbags can read: the bag itself, or its files with what they lack.

    Args:
        bag: the folder of a bag, or a file of one.
        notes: gets a sentence for what was lacking.

    Raises:
        BadInput: a folder without files of a bag.
    """
    files = [bag]
    if bag.is_dir():
        files = sorted(path for path in bag.iterdir() if path.suffix in STORAGE_FILES)
        if not files:
            must = "be the folder of a bag of ROS 2, with metadata.yaml or .mcap or .db3 files"
            raise BadInput("log", must, str(bag))
    lacks_end = [path for path in files if _lacks_end(path)]
    lacks_metadata = bag.is_dir() and not (bag / "metadata.yaml").is_file()
    if not lacks_end and not lacks_metadata:
        yield [bag]
        return
    if lacks_metadata:
        notes.append("the bag has no metadata.yaml: its files are read without")
    notes.extend(f"{path.name} ends early, as after `kill -9`" for path in lacks_end)
    with tempfile.TemporaryDirectory() as folder:
        yield [_mended(path, Path(folder)) if path in lacks_end else path for path in files]


def _lacks_end(path: Path) -> bool:
    if path.suffix == ".db3":
        return path.with_name(f"{path.name}-journal").exists()
    with path.open("rb") as stream:
        size = stream.seek(0, 2)
        stream.seek(max(0, size - len(_MAGIC)))
        return stream.read() != _MAGIC


def _mended(path: Path, folder: Path) -> Path:
    """A copy up to what is whole, with an end."""
    copy = folder / path.name
    shutil.copyfile(path, copy)
    if path.suffix == ".db3":
        shutil.copyfile(path.with_name(f"{path.name}-journal"), copy.with_name(f"{copy.name}-journal"))
        with contextlib.closing(sqlite3.connect(copy)) as connection:  # which takes back what was not committed
            connection.execute("SELECT count(*) FROM sqlite_master").fetchone()
        return copy
    with copy.open("r+b") as stream:
        stream.truncate(_end_of_records(stream.read()))
        stream.seek(0, 2)
        stream.write(END_WITHOUT_INDEX)
    return copy


def _end_of_records(data: bytes) -> int:
    """Where the last whole record of the data section of an MCAP file ends."""
    offset = len(_MAGIC)
    while offset + _HEAD.size <= len(data):
        kind, size = _HEAD.unpack_from(data, offset)
        if not 0 < kind <= _LARGEST_KIND or kind == _DATA_END or offset + _HEAD.size + size > len(data):
            break
        offset += _HEAD.size + size
    return offset
