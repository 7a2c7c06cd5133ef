"""Reads a log of any known format, with a mapping or with what the messages of that format mean."""

import contextlib
import functools
import itertools
from collections.abc import Callable, Collection
from pathlib import Path

from undertow.core.errors import BadInput, error_location
from undertow.logs.ardupilot import read_ardupilot
from undertow.logs.bag_messages import STORAGE_FILES
from undertow.logs.csv_reader import read_csv
from undertow.logs.default_mappings import DEFAULTS, MAVLINK, ROS, usual_mapping
from undertow.logs.log import Log
from undertow.logs.mapped_log import log_of, suited
from undertow.logs.mapping import LogMapping
from undertow.logs.mavlink_log import read_mavlink
from undertow.logs.mcap_reader import has_ros_messages, read_mcap
from undertow.logs.px4 import read_px4
from undertow.logs.recording import Recording, TopicMessages
from undertow.logs.ros1_messages import ROS1_SUFFIXES
from undertow.logs.ros_bag import read_ros_bag
from undertow.logs.run_log import read_run

_SHOWN_TOPICS, _SHOWN_COLUMNS = 4, 6  # in an error


def read_log(path: Path, mapping: LogMapping | None = None, location: Callable[[str], str] = lambda name: "") -> Log:
    """The log in a file.

    Args:
        path: .mcap, .csv, .nc (a run), .bin (ArduPilot), .tlog (MAVLink), .ulg (PX4), .bag (ROS 1), .db3, or the
            folder of a bag of ROS 2.
        mapping: where signals stand; they go before those that the format itself explains.
        location: file and line of a key of the mapping.

    Raises:
        BadInput: no such file, damaged, of no known format, or without what the mapping names.
    """
    if not path.exists():
        raise BadInput("log", "be an existing file", str(path))
    with _readable(path):
        recording = _reader(path, _names(mapping))(path)
    if isinstance(recording, Log):
        if mapping is not None:
            got = f"given for {recording.source}, which holds them by name"
            raise BadInput("mapping", "be left out for a log whose signals are known", got)
        return recording
    return _mapped(recording, mapping, location)


def _names(mapping: LogMapping | None) -> set[str]:
    """Topics and types that are looked for in a bag or a telemetry log; "" where the only topic is meant."""
    entries_of_mapping = () if mapping is None else mapping.signals.values()
    usual = (ROS.signals.values(), MAVLINK.signals.values())
    return {
        entry.topic for entries in (*entries_of_mapping, *usual[0], *usual[1]) for entry in entries if not entry.motors
    }


def _mapped(recording: Recording, mapping: LogMapping | None, location: Callable[[str], str]) -> Log:
    usual, guesses = usual_mapping(recording)
    usual, frames = suited(recording, usual)
    recording = recording._replace(notes=(*recording.notes, *guesses, *frames))
    if mapping is None:
        if not usual.signals:
            hint = f"Give a mapping (`--mapping FILE`). It has {_listed(recording)}"
            got = f"{recording.source}, a {recording.format} file whose columns may mean anything"
            if recording.format in DEFAULTS:
                got = f"{recording.source}, which has none of the messages that are known"
            raise BadInput("mapping", "be given", got, hint=hint)
        return log_of(recording, usual)
    signals = {name: entries for name, entries in usual.signals.items() if not _replaced(name, mapping)}
    with error_location("mapping", location):
        _check_time(recording, mapping)
        return log_of(recording, mapping._replace(signals=signals | dict(mapping.signals)))


def _check_time(recording: Recording, mapping: LogMapping) -> None:
    """Check that the mapping names the time of a table, and of nothing whose messages have times of their own."""
    column = mapping.time[0]
    if recording.format == "CSV" and not column:
        raise BadInput("time", "be given: the column of the time, and its unit", hint="`time: {column: t, unit: s}`")
    if recording.format != "CSV" and column:
        raise BadInput("time", f"be left out: the messages of {recording.source} have times", column)


def _replaced(name: str, mapping: LogMapping) -> bool:
    """Whether a mapping gives a signal itself; attitude and quaternion are the same one."""
    attitudes = ("attitude", "quaternion")
    return any(signal in mapping.signals for signal in (attitudes if name in attitudes else (name,)))


def _listed(recording: Recording) -> str:
    names = [f"{topic or 'columns'} ({_columns(table)})" for topic, table in recording.tables.items()]
    names += [f"{topic}, which is left out: {reason}" for topic, reason in recording.left_out.items()]
    return "; ".join(names[:_SHOWN_TOPICS]) + ("; ..." if len(names) > _SHOWN_TOPICS else "")


def _columns(table: TopicMessages) -> str:
    """Names of the columns of a table, or of the first of them."""
    names = list(itertools.islice(table.fields, _SHOWN_COLUMNS))
    ellipsis = ["..."] if len(table.fields) > _SHOWN_COLUMNS else []
    return ", ".join([*names, *ellipsis]) or "no numbers"


def _reader(path: Path, names: Collection[str]) -> Callable[[Path], Log | Recording]:
    if path.is_dir():
        files = " ".join(file.name for file in path.iterdir())
        if not any(name in files for name in ("metadata.yaml", *STORAGE_FILES)):
            raise BadInput("log", "be a file, or the folder of a bag of ROS 2", f"{path}, without .mcap or .db3 files")
        return functools.partial(read_ros_bag, names=names)
    suffix = path.suffix.lower()
    if suffix == ".mcap":
        return functools.partial(read_ros_bag, names=names) if has_ros_messages(path) else read_mcap
    readers = {".csv": read_csv, ".txt": read_csv, ".nc": read_run, ".bin": read_ardupilot, ".ulg": read_px4}
    readers |= dict.fromkeys((".db3", *ROS1_SUFFIXES), functools.partial(read_ros_bag, names=names))
    readers |= {".tlog": functools.partial(read_mavlink, names=names)}
    if suffix not in readers:
        raise BadInput("log", f"be one of .mcap, {', '.join(readers)}, or the folder of a bag", path.name)
    return readers[suffix]


@contextlib.contextmanager
def _readable(path: Path):
    """A file that cannot be opened is bad input."""
    try:
        yield
    except OSError as error:
        raise BadInput("log", "be a file that can be read", f"{path}: {error.strerror or error}") from None
