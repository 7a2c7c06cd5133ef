"""Reads ArduPilot's .bin files (DataFlash logs) by pymavlink."""

import contextlib
from pathlib import Path

import numpy as np

from undertow.core.errors import BadInput
from undertow.logs.extra import check_installed, quiet
from undertow.logs.recording import Recording, Table

_START = b"\xa3\x95"  # of every message


def read_ardupilot(path: Path) -> Recording:
    """Tables of the numbers of each kind of message; those of several sensors or cores as `IMU[0]`, `IMU[1]`, ...

    Times are TimeUS, since the start of the autopilot. Multipliers of the format (centidegrees, ...) are applied.

    Raises:
        BadInput: damaged, or pymavlink is not installed.
    """
    check_installed("pymavlink", "pymavlink")
    from pymavlink.DFReader import DFReader_binary

    size = path.stat().st_size
    with path.open("rb") as stream:
        if not stream.read(2).startswith(_START):
            raise BadInput("log", "be a .bin file of ArduPilot", f"{path.name}, which does not begin like one")
    notes: list[str] = []
    rows: dict[tuple[str, str], list[list[float]]] = {}
    fields: dict[str, list[str]] = {}
    reader = DFReader_binary.__new__(DFReader_binary)  # its constructor may fail with the file open
    try:
        with quiet(notes):
            reader.__init__(str(path), zero_time_base=True)
            while (message := reader.recv_msg()) is not None:
                _keep(message, rows, fields)
    except Exception as error:  # whatever bytes may cause
        place = getattr(reader, "offset", 0)
        got = f"{path.name}, near byte {place} of {size}: {error or type(error).__name__}"
        raise BadInput("log", "be an undamaged .bin file of ArduPilot", got) from None
    finally:
        for name in ("data_map", "filehandle"):
            with contextlib.suppress(AttributeError, BufferError):  # where it was not opened, or is still looked at
                getattr(reader, name).close()
    tables = {}
    for (kind, topic), numbers in rows.items():
        array = np.array(numbers, dtype=float)
        tables[topic] = Table(array[:, 0] * 1e-6, {name: array[:, i] for i, name in enumerate(fields[kind])}, kind)
    if not tables:
        raise BadInput("log", "have messages with TimeUS", f"{path.name}, which has none")
    return Recording(tables, path.name, "ArduPilot", tuple(notes))


def _keep(message, rows: dict, fields: dict) -> None:
    """Keep the numbers of a message that has a time."""
    kind = message.get_type()
    names = message.get_fieldnames()
    if not names or names[0] != "TimeUS":
        return
    values = [getattr(message, name) for name in names]
    if kind not in fields:
        fields[kind] = [n for n, value in zip(names, values, strict=True) if isinstance(value, int | float)]
    instance = message.fmt.instance_field
    # Files of before 2020 do not say which field numbers the sensors or cores.
    if instance is None:
        instance = (
            "C"
            if kind in ("XKF1", "NKF1") and "C" in names
            else "I"
            if kind in ("IMU", "BARO") and "I" in names
            else None
        )
    topic = kind if instance is None else f"{kind}[{getattr(message, instance)}]"
    row = [float(value) for n, value in zip(names, values, strict=True) if n in fields[kind]]
    rows.setdefault((kind, topic), []).append(row)
