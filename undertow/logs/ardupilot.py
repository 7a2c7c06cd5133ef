"""Reads ArduPilot's .bin files (DataFlash logs).

Every message is A3 95, its type and its fields; messages FMT (type 80) describe the types, FMTU the units, in which `#`
marks the field that numbers sensors or cores. Source: libraries/AP_Logger/LogStructure.h of ArduPilot. pymavlink
gives the same numbers (tests/logs/test_formats.py), but does not end on some damaged files.
"""

from pathlib import Path
from typing import NamedTuple

import numpy as np

from undertow.core.errors import BadInput
from undertow.logs.recording import Recording, TopicMessages

_HEAD, _FMT = b"\xa3\x95", 0x80

# Character of a format -> type in NumPy, and factor of the value; texts and arrays are no columns.
_TYPES = {
    "b": ("i1", 1.0),
    "B": ("u1", 1.0),
    "M": ("u1", 1.0),
    "g": ("<f2", 1.0),
    "h": ("<i2", 1.0),
    "H": ("<u2", 1.0),
    "i": ("<i4", 1.0),
    "I": ("<u4", 1.0),
    "f": ("<f4", 1.0),
    "d": ("<f8", 1.0),
    "q": ("<i8", 1.0),
    "Q": ("<u8", 1.0),
    "c": ("<i2", 100.0),  # hundredths
    "C": ("<u2", 100.0),
    "e": ("<i4", 100.0),
    "E": ("<u4", 100.0),
    "L": ("<i4", 1e7),
    "n": ("S4", 0.0),
    "N": ("S16", 0.0),
    "Z": ("S64", 0.0),
    "a": ("S64", 0.0),
}

# Kinds whose sensors or cores are numbered, in files of before 2020 that do not say so.
_NUMBERED = {"XKF1": "C", "NKF1": "C", "IMU": "I", "BARO": "I"}


class _Kind(NamedTuple):
    """A kind of message: its name, its fields, their divisors (0 for texts), and its bytes with the head."""

    name: str
    fields: np.dtype
    divisors: tuple[float, ...]
    size: int


def _kind(name: str, form: str, columns: list[str]) -> _Kind | None:
    """A kind by its description; None where that makes no sense, as in a damaged file."""
    good = len(form) == len(columns) == len(set(columns)) and all(columns) and set(form) <= set(_TYPES)
    if not good or not form or not name.isascii() or not name.isprintable():
        return None
    fields = np.dtype([(column, _TYPES[type_letter][0]) for column, type_letter in zip(columns, form, strict=True)])
    return _Kind(name, fields, tuple(_TYPES[type_letter][1] for type_letter in form), 3 + fields.itemsize)


_OF_FMT = _kind("FMT", "BBnNZ", ["Type", "Length", "Name", "Format", "Columns"])


class _Scan(NamedTuple):
    """Where the messages of a file stand.

    Attributes:
        places: of each kind, by its description.
        numbered: column that numbers the sensors or cores, by name of the kind.
        lost: bytes that belong to no message.
    """

    places: dict[_Kind, list[int]]
    numbered: dict[str, str]
    lost: int


def read_ardupilot(path: Path) -> Recording:
    """Tables of the numbers of each kind of message; those of several sensors or cores as `IMU[0]`, `IMU[1]`, ...

    Times are TimeUS, since the start of the autopilot. What belongs to no message is left out, with a note.

    Raises:
        BadInput: no such file, without messages that have a time, or with times that are text.
    """
    data = path.read_bytes()
    if not data.startswith(_HEAD):
        raise BadInput("log", "be a .bin file of ArduPilot", f"{path.name}, which does not begin like one")
    scan = _scanned(data)
    tables = {}
    parameters = {}
    for kind, places in scan.places.items():
        if kind.fields.names is None or kind.fields.names[0] != "TimeUS":
            continue
        if not kind.divisors[0]:
            raise BadInput("log", "have numbers as TimeUS", f"{path.name}, whose messages {kind.name} have text there")
        rows = np.frombuffer(b"".join(data[offset + 3 : offset + kind.size] for offset in places), kind.fields)
        tables |= _tables(kind, rows, scan.numbered.get(kind.name, ""))
        if kind.name == "PARM":
            parameters |= _parameters(kind, rows)
    if not tables:
        got = f"{path.name}, which has none in {len(data)} bytes"
        raise BadInput("log", "have messages with TimeUS", got)
    notes = (f"{scan.lost} of {len(data)} bytes are damaged or cut off, and left out",) if scan.lost else ()
    return Recording(tables, path.name, "ArduPilot", notes, parameters)


def _parameters(kind: _Kind, rows: np.ndarray) -> dict[str, float]:
    """Parameters of the autopilot, by name, from its messages PARM; the last value of each."""
    forms = dict(zip(kind.fields.names or (), kind.divisors, strict=True))
    if forms.get("Name") != 0.0 or not forms.get("Value"):
        return {}
    names = [name.decode("latin-1") for name in rows["Name"].tolist()]
    return dict(zip(names, (rows["Value"] / forms["Value"]).tolist(), strict=True))


def _scanned(data: bytes) -> _Scan:
    assert _OF_FMT is not None
    kinds = {_FMT: _OF_FMT}
    places = {}
    numbered = dict(_NUMBERED)
    offset = lost = 0
    while offset < len(data):
        kind = kinds.get(data[offset + 2]) if data[offset : offset + 2] == _HEAD and offset + 2 < len(data) else None
        if kind is None or offset + kind.size > len(data):
            next_head = data.find(_HEAD, offset + 1)
            next_head = len(data) if next_head < 0 else next_head
            lost += next_head - offset
            offset = next_head
            continue
        if kind.name == "FMT":
            number, described_kind = _described(data, offset)
            if described_kind is not None:
                kinds[number] = described_kind
        elif kind.name == "FMTU":
            _number(data, offset, kind, kinds, numbered)
        places.setdefault(kind, []).append(offset)
        offset += kind.size
    return _Scan(places, numbered, lost)


def _described(data: bytes, offset: int) -> tuple[int, _Kind | None]:
    """Type and kind that a message FMT describes; None where it is damaged."""
    assert _OF_FMT is not None
    number, size, name, form, columns = np.frombuffer(data, _OF_FMT.fields, 1, offset + 3)[0].item()
    texts = [part.decode("latin-1") for part in (name, form, columns)]
    kind = _kind(texts[0], texts[1], texts[2].split(","))
    return number, kind if kind is not None and kind.size == size and number != _FMT else None


def _number(data: bytes, offset: int, kind: _Kind, kinds: dict[int, _Kind], numbered: dict[str, str]) -> None:
    """Remember the column that a message FMTU says to number sensors or cores."""
    fields = np.frombuffer(data, kind.fields, 1, offset + 3)[0]
    if not {"FmtType", "UnitIds"} <= set(kind.fields.names or ()):
        return
    about = kinds.get(int(fields["FmtType"]))
    units = bytes(fields["UnitIds"])
    index = units.find(b"#")
    if about is not None and about.fields.names and 0 <= index < len(about.fields.names):
        numbered[about.name] = about.fields.names[index]


def _tables(kind: _Kind, rows: np.ndarray, instance: str) -> dict[str, TopicMessages]:
    """The table of a kind, or one per sensor or core."""
    columns = zip(kind.fields.names or (), kind.divisors, strict=True)
    with np.errstate(invalid="ignore"):  # signalling NaNs
        fields = {name: rows[name] / divisor for name, divisor in columns if divisor}
    time = rows["TimeUS"] * 1e-6
    if instance not in fields:
        return {kind.name: TopicMessages(time, fields, kind.name)}
    tables = {}
    for number in np.unique(fields[instance]):
        of_instance = fields[instance] == number
        part = {name: values[of_instance] for name, values in fields.items()}
        tables[f"{kind.name}[{number:g}]"] = TopicMessages(time[of_instance], part, kind.name)
    return tables
