"""A log as a recording of Rerun (.rrd): series, the vehicle in three dimensions, its path.

Rerun is imported by the functions, and sends no usage data.
"""

import importlib.util
import os
from pathlib import Path
from typing import Any

import numpy as np

from undertow.core.atomic_io import write_whole
from undertow.core.errors import BadInput
from undertow.logs.frames import quaternions
from undertow.logs.log import Log
from undertow.logs.mcap_writer import pose_of
from undertow.logs.messages import group_of

_SIZE = (0.5, 0.4, 0.3)  # m, of a vehicle whose size is unknown
_VEHICLE, _PATH = [0, 114, 178], [224, 123, 0]


def check_rerun(path: Path, folder: Path, overwrite: bool) -> None:
    """Check, before anything is run, that a recording can be written; `folder` will exist by then.

    Raises:
        BadInput: Rerun is not installed, the name does not end in .rrd, its folder does not exist, or it would replace
            one.
    """
    if path.suffix != ".rrd":
        raise BadInput("--rerun", "be a file whose name ends in .rrd", str(path))
    if importlib.util.find_spec("rerun") is None:
        remedy = "In the folder of undertow, run: pip install -c constraints.txt '.[viz]'"
        raise BadInput("", "", f"Rerun is not installed. {remedy}")
    if not path.parent.is_dir() and path.parent.resolve() != folder.resolve():
        raise BadInput("--rerun", "be in an existing folder", str(path))
    if path.exists() and not overwrite:
        raise BadInput("--rerun", "be a new file", f"{path}, which exists", hint="Add --overwrite to replace it")


def write_rerun(log: Log, path: Path, size: Any = None) -> None:
    """Write a log to a file.

    Args:
        log: with the signals.
        path: of the file.
        size: length, width and height of the vehicle, m; None for usual ones.

    Raises:
        OSError: the file cannot be written.
    """
    os.environ["RERUN_ANALYTICS"] = "0"  # read when it is imported
    import rerun

    recording = rerun.RecordingStream("undertow")
    memory = recording.memory_recording()  # where the disk is full, Rerun's own file ends without an error
    _write_signals(rerun, recording, log)
    _write_view(rerun, recording, log, size)
    recording.flush()
    write_whole(path, memory.drain_as_bytes())
    recording.disconnect()


def _write_signals(rerun: Any, recording: Any, log: Log) -> None:
    for name, series in log.signals.items():
        if not len(series.time):
            continue
        entity = f"{group_of(name)}/{name}"
        titles = [title or name for title in series.column_names()]
        lines = rerun.SeriesLines(names=[f"{title} [{series.unit}]" for title in titles])
        recording.log(entity, lines, static=True)
        index = rerun.TimeColumn("time", duration=series.time)
        columns = rerun.Scalars.columns(scalars=series.flat().astype(float).ravel())
        parts = columns.partition(np.full(len(series.time), len(titles)))
        rerun.send_columns(entity, [index], parts, recording=recording)


def _write_view(rerun: Any, recording: Any, log: Log, size: Any) -> None:
    pose = pose_of(log.signals)
    if pose is None or not len(pose[0]):
        return
    is_finite = np.isfinite(pose[1]).all(axis=1)
    time, outputs = pose[0][is_finite], pose[1][is_finite]
    # North, east, down: x forward, y to the right, z down.
    recording.log("world", rerun.ViewCoordinates.FRD, static=True)
    recording.log("world/path", rerun.LineStrips3D([outputs[:, :3]], colors=[_PATH]), static=True)
    box = rerun.Boxes3D(sizes=[list(size if size is not None else _SIZE)], colors=[_VEHICLE])
    recording.log("world/vehicle", box, static=True)
    attitudes = np.roll(quaternions(outputs[:, 3:]), -1, axis=1)  # x, y, z, w
    transforms = rerun.Transform3D.columns(translation=outputs[:, :3], quaternion=attitudes)
    rerun.send_columns("world/vehicle", [rerun.TimeColumn("time", duration=time)], transforms, recording=recording)
