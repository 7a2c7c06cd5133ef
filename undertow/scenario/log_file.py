"""Reads a log with a mapping that stands in a YAML file, or in the scenario."""

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

from undertow.core.errors import BadInput, error_location
from undertow.logs.log import Log
from undertow.logs.mapping import mapping_of
from undertow.logs.read import read_log as read_mapped
from undertow.scenario.reading import Text, no_file
from undertow.scenario.yaml_text import load


def read_log(
    path: str | Path, mapping: str | Path | Mapping[str, Any] | None = None, folder: Path | None = None
) -> Log:
    """The log in a file of undertow or of another program, in our frames and units.

    Args:
        path: .mcap, .csv, .nc (a run), .bin (ArduPilot), .tlog (MAVLink), .ulg (PX4), .bag (ROS 1), .db3, or the
            folder of a bag of ROS 2.
        mapping: which columns are which signal: a .yaml file, or the same as a mapping. None for a format that says so
            itself. Its signals go before those of the format.
        folder: where relative paths start; None for the current one.

    Raises:
        BadInput: no such file, damaged, or without what the mapping names.
    """
    start = folder or Path()
    if mapping is None:
        return read_mapped(start / path)
    if isinstance(mapping, Mapping):
        return _read(start / path, mapping, lambda name: "")
    text = _text(start / mapping)
    return _read(start / path, text.data, text.location)


def _read(path: Path, mapping: Any, location: Callable[[str], str]) -> Log:
    """The log; errors about columns name the key of the mapping that names them."""
    with error_location("mapping", location):
        checked_mapping = mapping_of(mapping)
    return read_mapped(path, checked_mapping, location)


def _text(path: Path) -> Text:
    if not path.is_file():
        raise no_file(path, "mapping")
    try:
        text = path.read_text(encoding="utf-8")
    except (UnicodeDecodeError, OSError):
        raise BadInput("mapping", "be a YAML text file", str(path)) from None
    data, lines = load(text, path.name, "mapping")
    return Text(data if data is not None else {}, path.name, path.resolve().parent, lines)
