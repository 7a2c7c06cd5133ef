"""Reads .tlog files, the telemetry logs of ground stations: every MAVLink frame that passed, with the time it did.

Before each frame stand 8 bytes: microseconds since 1970, the most significant byte first. Frames are those of MAVLink 1
and 2 (mavlink.io/en/guide/serialization.html) and are decoded by pymavlink. What belongs to no whole frame is left out.
"""

from collections import Counter
from collections.abc import Collection, Iterator
from pathlib import Path
from typing import Any, NamedTuple

from undertow.core.errors import BadInput
from undertow.logs.message_fields import MessageFields
from undertow.logs.recording import Recording
from undertow.logs.vehicle_clock import on_vehicle_clock

# First byte of a frame, and its length without the payload.
_FRAMES = {0xFE: 8, 0xFD: 12}
_SIGNED, _SIGNATURE = 0x01, 13  # flag of MAVLink 2, and the bytes of the signature

_LATEST = 2**52  # us; times are earlier than the year 2112
_PARAMETER, _HEARTBEAT = 22, 0
_NO_AUTOPILOT = 8  # of a heartbeat: a camera or a ground station
_LEAP = 10_000_000  # us by which a time is damaged that differs so much from those before and after it


class _Frame(NamedTuple):
    """A frame: time of the ground station in us, type, (system, component), and its bytes."""

    time: int
    kind: int
    sender: tuple[int, int]
    data: bytes


class _Scan(NamedTuple):
    """What a file holds: messages by type and sender, parameters by sender, and bytes that belong to no whole frame."""

    fields: dict[tuple[str, tuple[int, int]], MessageFields]
    parameters: dict[tuple[int, int], dict[str, float]]
    autopilots: Counter
    lost: int
    times: int  # that are damaged


def read_mavlink(path: Path, names: Collection[str] = ("",)) -> Recording:
    """Tables of the messages of the vehicle's autopilot by type; those of other senders as `ATTITUDE[1:100]`.

    Times are those of the vehicle's own clock where a message has one, on the axis of the ground station; since the
    first frame.

    Args:
        path: of the file.
        names: types of which all messages are read; "" for all. Of others, the first message alone is read.

    Raises:
        BadInput: no such file, without frames, or pymavlink is not installed.
    """
    data = path.read_bytes()
    scan = _scanned(data, names)
    if not scan.fields:
        raise BadInput("log", "be a .tlog file of MAVLink", f"{path.name}, without a whole frame in {len(data)} bytes")
    senders = [sender for sender, _ in scan.autopilots.most_common()]
    vehicle = senders[0] if senders else next(iter(scan.fields))[1]
    start = min(min(fields.stamps) for fields in scan.fields.values())
    tables_of_vehicle = {
        name: fields.table(start) for (name, sender), fields in scan.fields.items() if sender == vehicle
    }
    tables, restarts = on_vehicle_clock(tables_of_vehicle)
    for (name, sender), fields in scan.fields.items():
        if sender != vehicle:
            tables[f"{name}[{sender[0]}:{sender[1]}]"] = fields.table(start)
    earliest = min(table.time.min() for table in tables.values())
    tables = {name: table._replace(time=table.time - earliest) for name, table in tables.items()}
    notes = [f"{scan.lost} of {len(data)} bytes belong to no whole frame, and are left out"] if scan.lost else []
    notes += [f"{scan.times} frames have damaged times, and are given those of others"] if scan.times else []
    notes += [f"the vehicle started again {restarts} times"] if restarts else []
    return Recording(tables, path.name, "MAVLink", tuple(notes), scan.parameters.get(vehicle, {}))


def _dialect() -> Any:
    """Messages of ArduPilot's dialect, which has those of all others that matter here.

    Raises:
        BadInput: pymavlink is not installed.
    """
    try:
        from pymavlink.dialects.v20 import ardupilotmega
    except ImportError:
        remedy = "In the folder of undertow, run: pip install -c constraints.txt '.[mavlink]'"
        raise BadInput("", "", f"pymavlink is not installed. {remedy}") from None
    return ardupilotmega


def _scanned(data: bytes, names: Collection[str]) -> _Scan:
    dialect = _dialect()
    decoder = dialect.MAVLink(None)
    types = dialect.mavlink_map
    scan = _Scan({}, {}, Counter(), 0, 0)
    offset = lost = damaged_times = 0
    before = None
    while offset < len(data):
        frame = _frame_at(data, offset)
        size = 0 if frame is None else 8 + len(frame.data)
        name = types[frame.kind].msgname if frame is not None and frame.kind in types else ""
        message = None
        if frame is not None and name and _requested(name, frame, names, scan):
            try:
                message = decoder.decode(bytearray(frame.data))
            except Exception:  # whatever bytes may cause
                name = ""
        if frame is not None and message is not None:
            time = _likely_time(before, frame.time, _frame_at(data, offset + size))
            damaged_times += time != frame.time
            before = time
            _add(scan, name, frame._replace(time=time), message)
        elif not size or not _begins(data, offset + size):
            size = 1
            lost += 1
        elif not name:  # damaged, or of another dialect
            lost += size
        offset += size
    return scan._replace(lost=lost, times=damaged_times)


def _requested(name: str, frame: _Frame, names: Collection[str], scan: _Scan) -> bool:
    """Whether a frame is decoded: it is requested, of use to the reader itself, or the first of its type and sender."""
    if "" in names or name in names or frame.kind in (_PARAMETER, _HEARTBEAT):
        return True
    return (name, frame.sender) not in scan.fields


def _frame_at(data: bytes, offset: int) -> _Frame | None:
    """The frame whose time stands at a place; None where there is none that ends within the file."""
    begin = offset + 8
    overhead = _FRAMES.get(data[begin]) if begin + 10 <= len(data) else None
    time = int.from_bytes(data[offset:begin], "big")
    if overhead is None or time >= _LATEST:
        return None
    newer = overhead == _FRAMES[0xFD]
    size = overhead + data[begin + 1] + (_SIGNATURE if newer and data[begin + 2] & _SIGNED else 0)
    if begin + size > len(data):
        return None
    head = data[begin : begin + 10]
    sender = (head[5], head[6]) if newer else (head[3], head[4])
    kind = int.from_bytes(head[7:10], "little") if newer else head[5]
    return _Frame(time, kind, sender, data[begin : begin + size])


def _likely_time(before: int | None, time: int, following: _Frame | None) -> int:
    """The time of a frame, or that of its neighbours where these agree on another: no checksum covers it."""
    after = time if following is None else following.time
    before = after if before is None else before
    return before if abs(time - before) > _LEAP and abs(after - before) < _LEAP else time


def _begins(data: bytes, offset: int) -> bool:
    """Whether a frame seems to begin at a place, or the file ends there."""
    return offset == len(data) or _frame_at(data, offset) is not None


def _add(scan: _Scan, name: str, frame: _Frame, message: Any) -> None:
    """Add a message: its numbers, and what it says of parameters and of its sender."""
    if frame.kind == _HEARTBEAT and message.autopilot != _NO_AUTOPILOT:
        scan.autopilots[frame.sender] += 1
    if frame.kind == _PARAMETER:
        scan.parameters.setdefault(frame.sender, {})[str(message.param_id)] = float(message.param_value)
    fields = scan.fields.setdefault((name, frame.sender), MessageFields(name))
    fields.add(frame.time * 1000, len(fields.stamps), _numbers(message))


def _numbers(message: Any) -> Iterator[tuple[str, float]]:
    for name in message.fieldnames:
        value = getattr(message, name)
        if isinstance(value, int | float):
            yield name, float(value)
        elif isinstance(value, list | tuple):
            yield from (
                (f"{name}[{i}]", float(entry)) for i, entry in enumerate(value) if isinstance(entry, int | float)
            )
