"""rosbag2: what a node sees is recorded, and a finished run is written."""

from pathlib import Path
from typing import Any

import xarray as xr
from cyclonedds.idl import IdlStruct
from numpy.typing import NDArray
from rosbags.interfaces import Connection
from rosbags.rosbag2 import StoragePlugin, Writer

from undertow.core import checks
from undertow.core.errors import BadInput
from undertow.core.measurement import BODY_OUTPUTS
from undertow.interop.ros2 import messages as ros
from undertow.interop.ros2.frames import body_velocity_of_rates
from undertow.interop.ros2.from_messages import SECOND, Frames, PoseAndVelocity, thruster_label
from undertow.interop.ros2.to_messages import odometry_of, stamp_of, target_message, thrusters_of
from undertow.logs.frames import quaternions

STORAGES = ("mcap", "sqlite3")


class BagWriter:
    """A rosbag2 that is being written; a context in which it is open, and complete also after an exception.

    Args:
        folder: a new folder.
        storage: `mcap` or `sqlite3`.

    Raises:
        BadInput: another storage, or the folder exists.
    """

    def __init__(self, folder: Path, storage: str = "mcap"):
        checks.choice("storage", storage, STORAGES)
        if folder.exists():
            raise BadInput(str(folder), "be a new folder", "there already", hint="A bag is never replaced")
        self._writer = Writer(folder, version=9, storage_plugin=StoragePlugin[storage.upper()])
        self._connections: dict[tuple[str, type[IdlStruct]], Connection] = {}

    def __enter__(self) -> "BagWriter":
        self._writer.open()
        return self

    def __exit__(self, *error: object) -> None:
        self._writer.close()  # whatever ended the recording: without metadata nobody reads it

    def write(self, topic: str, message: IdlStruct, nanoseconds: int) -> None:
        """Add a message that was sent or received at a time."""
        key = topic, type(message)
        if key not in self._connections:
            kind = ros.ros_type(key[1])
            self._connections[key] = self._writer.add_connection(topic, kind, typestore=ros.typestore())
        self._writer.write(self._connections[key], nanoseconds, message.serialize())


def write_rosbag2(run: Any, folder: str | Path, storage: str = "mcap") -> None:
    """Write a run of a vehicle as a rosbag2, with the records of the run as messages.

    Topics: /odom (what the controller received), /ground_truth (the true motion), /thrusters (the applied input),
    /target_pose (the reference) and /clock.

    Args:
        run: a `Run`, its dataset, or the path of a run.nc.
        folder: a new folder.
        storage: `mcap` or `sqlite3`.

    Raises:
        BadInput: the run is of something else than a vehicle, or the folder exists.
    """
    if isinstance(run, str | Path):
        with xr.open_dataset(run, engine="netcdf4") as dataset:
            write_rosbag2(dataset.load(), folder, storage)
        return
    dataset = getattr(run, "dataset", run)
    if tuple(dataset["axis"].values) != BODY_OUTPUTS:
        raise BadInput("run", "be of a vehicle", f"of a plant with outputs {', '.join(dataset['axis'].values)}")
    names = ("measured_position", "measured_velocity", "position", "velocity", "input", "reference")
    columns = [dataset[name].values.astype(float) for name in names]
    frames, label = Frames(), thruster_label(dataset["input"].attrs["units"])
    with BagWriter(Path(folder), storage) as bag:
        for time, *row in zip(dataset["time"].values, *columns, strict=True):
            now = round(float(time) * SECOND)
            stamp = stamp_of(now)
            measured, true, (applied, reference) = _motion(*row[:2]), _motion(*row[2:4]), row[4:]
            bag.write("/clock", ros.Clock(stamp), now)
            bag.write("/odom", odometry_of(measured, stamp, frames), now)
            bag.write("/ground_truth", odometry_of(true, stamp, frames), now)
            bag.write("/target_pose", target_message(reference, stamp, frames), now)
            bag.write("/thrusters", thrusters_of(applied, label), now)


def _motion(position: NDArray, rates: NDArray) -> PoseAndVelocity:
    angles = position[3:]
    return PoseAndVelocity(position[:3], quaternions(angles), body_velocity_of_rates(angles, rates))
