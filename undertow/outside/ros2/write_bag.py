"""rosbag2: what a node sees is recorded, and a finished run is written."""

import contextlib
import errno
import io
import json
import os
import sqlite3
import struct
import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any, cast

from cyclonedds.idl import IdlStruct
from numpy.typing import NDArray
from rosbags.interfaces import Connection
from rosbags.rosbag2 import StoragePlugin, Writer
from rosbags.rosbag2.storage_mcap import McapWriter
from rosbags.rosbag2.storage_sqlite3 import Sqlite3Writer

from undertow.core import checks
from undertow.core.atomic_io import fsync_tree, sync, write_whole
from undertow.core.errors import BadInput
from undertow.core.measurement import BODY_OUTPUTS
from undertow.logs.frames import quaternions
from undertow.logs.run_log import read_dataset
from undertow.outside.ros2 import messages as ros
from undertow.outside.ros2.frames import body_velocity_of_rates
from undertow.outside.ros2.from_messages import SECOND, Frames, PoseAndVelocity, thruster_label
from undertow.outside.ros2.to_messages import odometry_of, stamp_of, target_message, thrusters_of

STORAGES = ("mcap", "sqlite3")

_VERSION = 9  # of the format
_HEAD = struct.Struct("<BQ")  # of a record of MCAP: its kind, and the bytes that follow
_DATA_END, _FOOTER = 0x0F, 0x02
# The end of an MCAP file without an index: readers look through the whole file instead.
_END_WITHOUT_INDEX = _HEAD.pack(_DATA_END, 4) + bytes(4) + _HEAD.pack(_FOOTER, 20) + bytes(20) + b"\x89MCAP0\r\n"

_BUFFER = 2**23  # bytes, more than a chunk: what `flush` writes is written at once


class BagWriter:
    """A rosbag2 that is being written; a context in which it is open, and complete also after an exception.

    After `flush` the bag is whole: what was written before can be read, by rosbags as well, however the process ends.

    Args:
        folder: a new folder.
        storage: `mcap` or `sqlite3`.

    Attributes:
        folder: of the bag.

    Raises:
        BadInput: another storage, or the folder exists.
    """

    def __init__(self, folder: Path, storage: str = "mcap"):
        checks.choice("storage", storage, STORAGES)
        if folder.exists():
            raise BadInput(str(folder), "be a new folder", "there already", hint="A bag is never replaced")
        self.folder = folder
        self._writer = Writer(folder, version=_VERSION, storage_plugin=StoragePlugin[storage.upper()])
        self._connections: dict[tuple[str, type[IdlStruct]], Connection] = {}
        self._ended = False  # whether the file has an end, which the next message replaces

    def __enter__(self) -> "BagWriter":
        return self.open()

    def open(self) -> "BagWriter":
        """Make the bag; by the thread that writes to it."""
        self._writer.open()
        if isinstance(storage := self._writer.storage, McapWriter):  # so that `flush` makes one write of its own
            storage.bio = io.BufferedWriter(cast(Any, storage.bio.detach()), _BUFFER)
        self.flush()
        return self

    def __exit__(self, *error: object) -> None:
        self.close()  # whatever ended the recording: without metadata nobody reads it

    def write(self, entry: tuple[str, IdlStruct, int]) -> None:
        """Add a message: its topic, itself, and the time in ns at which it was sent or received."""
        topic, message, nanoseconds = entry
        self._continue()
        key = topic, type(message)
        if key not in self._connections:
            kind = ros.ros_type(key[1])
            self._connections[key] = self._writer.add_connection(topic, kind, typestore=ros.typestore())
        self._writer.write(self._connections[key], nanoseconds, message.serialize())

    def flush(self) -> None:
        """Bring all messages to the disk, with an end of the file and metadata.yaml."""
        write_whole(self._writer.metapath, _metadata(self._writer))
        storage = self._writer.storage
        if isinstance(storage, McapWriter):
            self._continue()
            if storage.chunk.bio.tell():
                storage.close_chunk()
            storage.bio.write(_END_WITHOUT_INDEX)
            storage.bio.flush()
            os.fsync(storage.bio.fileno())
            self._ended = True
        elif isinstance(storage, Sqlite3Writer):
            storage.conn.commit()

    def close(self, dropped: int = 0) -> None:
        """Write the end of the bag; nothing may be written afterwards.

        Args:
            dropped: messages that are missing.
        """
        self._continue()
        if dropped:
            self._writer.set_custom_data("missing_messages", str(dropped))
        self._writer.close()

    def abandon(self) -> None:
        """Close the bag without its end."""
        with contextlib.suppress(Exception):
            self._writer.abort()

    def _continue(self) -> None:
        """Go back to before the end of the file, where there is one."""
        if self._ended and isinstance(storage := self._writer.storage, McapWriter):
            storage.bio.seek(-len(_END_WITHOUT_INDEX), os.SEEK_CUR)
        self._ended = False


@contextlib.contextmanager
def new_bag(folder: Path, storage: str) -> Iterator[BagWriter]:
    """A bag that appears whole or not at all; its files have the name of its folder."""
    BagWriter(folder, storage)  # refuses a folder that is there, before anything is written
    with tempfile.TemporaryDirectory(dir=folder.parent, prefix=".") as hidden:
        inner = Path(hidden) / folder.name
        try:
            with BagWriter(inner, storage) as bag:
                yield bag
        except sqlite3.Error as error:
            raise OSError(errno.EIO, str(error), str(folder)) from None
        fsync_tree(inner)
        os.replace(inner, folder)
    sync(folder.parent)


def write_rosbag2(run: Any, folder: str | Path, storage: str = "mcap") -> None:
    """Write a run of a vehicle as a rosbag2, with the records of the run as messages.

    Topics: /odom (what the controller received), /ground_truth (the true motion), /thrusters (the applied input),
    /target_pose (the reference) and /clock.

    Args:
        run: a `Run`, its dataset, or the path of a run.nc.
        folder: a new folder.
        storage: `mcap` or `sqlite3`.

    Raises:
        BadInput: the run is of something else than a vehicle, a file is damaged, or the folder exists.
    """
    dataset = read_dataset(Path(run), "run") if isinstance(run, str | Path) else getattr(run, "dataset", run)
    outputs = tuple(dataset["axis"].values) if "axis" in dataset.coords else ()
    if outputs != BODY_OUTPUTS:
        raise BadInput(
            "run", "be of a vehicle", f"of a plant with outputs {', '.join(outputs) or 'that it does not name'}"
        )
    names = ("measured_position", "measured_velocity", "position", "velocity", "input", "reference")
    columns = [dataset[name].values.astype(float) for name in names]
    frames = Frames()
    label = thruster_label(dataset["input"].attrs["units"])
    with new_bag(Path(folder), storage) as bag:
        for time, *row in zip(dataset["time"].values, *columns, strict=True):
            now = round(float(time) * SECOND)
            stamp = stamp_of(now)
            measured = _motion(*row[:2])
            true = _motion(*row[2:4])
            applied, reference = row[4:]
            bag.write(("/clock", ros.Clock(stamp), now))
            bag.write(("/odom", odometry_of(measured, stamp, frames), now))
            bag.write(("/ground_truth", odometry_of(true, stamp, frames), now))
            bag.write(("/target_pose", target_message(reference, stamp, frames), now))
            bag.write(("/thrusters", thrusters_of(applied, label), now))


def _motion(position: NDArray, rates: NDArray) -> PoseAndVelocity:
    angles = position[3:]
    return PoseAndVelocity(position[:3], quaternions(angles), body_velocity_of_rates(angles, rates))


def _metadata(writer: Writer) -> str:
    """Text of metadata.yaml, of what was written so far. It is JSON, which is YAML, and quick to write."""
    count = sum(writer.counts.values())
    start = {"nanoseconds_since_epoch": writer.min_timestamp}
    duration = {"nanoseconds": max(0, writer.max_timestamp - writer.min_timestamp)}
    assert writer.storage is not None, "the bag is open"
    name = writer.storage.path.name
    topics = [
        {
            "topic_metadata": {
                "name": connection.topic,
                "type": connection.msgtype,
                "serialization_format": "cdr",
                "offered_qos_profiles": [],
                "type_description_hash": connection.digest,
            },
            "message_count": writer.counts[connection.id],
        }
        for connection in writer.connections
    ]
    about = {
        "version": writer.version,
        "storage_identifier": writer.storage_plugin.name.lower(),
        "relative_file_paths": [name],
        "duration": duration,
        "starting_time": start,
        "message_count": count,
        "topics_with_message_count": topics,
        "compression_format": "",
        "compression_mode": "",
        "files": [{"path": name, "starting_time": start, "duration": duration, "message_count": count}],
        "custom_data": None,
        "ros_distro": "rosbags",
    }
    return json.dumps({"rosbag2_bagfile_information": about}, indent=1) + "\n"
