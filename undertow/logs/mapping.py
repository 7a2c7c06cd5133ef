"""A mapping: which columns of a file are which signal, in which unit and frame; and the log that it makes of a file.

time: {column: time_ms, unit: ms}
world: ENU
signals:
  position: {columns: [x, y, z]}
  attitude: {columns: [roll, pitch, yaw], unit: deg}
  input: {columns: [pwm1, pwm2, pwm3, pwm4], unit: us, supply: 16}
"""

import re
from collections.abc import Iterable, Mapping
from typing import Any, NamedTuple

import numpy as np

from undertow.core.errors import BadInput, did_you_mean, known_key, within
from undertow.logs import frames, units
from undertow.logs.known_signals import BODY, SIGNALS, WORLD, Known, thruster_columns
from undertow.logs.log import Log, Series
from undertow.logs.recording import Recording, Table, cleaned

# Pulses and duties become volts with these, as `undertow describe esc` has them.
_ESC = {"neutral": 1500.0, "span": 400.0, "dead_band": 25.0}

# Units in which an input is a share of the supply, and their factor.
_VOLTS, _SHARES = ("input", "commanded_input"), {"us": 1.0, "1": 1.0, "%": 0.01}

_NUMBERED = re.compile(r"(?P<head>.*?)(?P<number>\d{1,4})(?P<tail>\D*)")
_MOST = 64  # columns of a signal


class Entry(NamedTuple):
    """Where a signal stands in a file.

    Attributes:
        columns: of the file, in our order; `C1..C8` stands for C1, C2, ..., C8.
        topic: whose columns they are, or the type of its messages; "" for the only one.
        unit: of the columns; "" for ours.
        frame: world and body axes of the file.
        supply: V, for inputs given as pulses or duty.
        esc: neutral, span and dead band of pulses, us.
        must: columns and the number that they must have throughout, such as that of a frame.
    """

    columns: tuple[str, ...]
    topic: str = ""
    unit: str = ""
    frame: tuple[str, str] = ("NED", "FRD")
    supply: float | None = None
    esc: Mapping[str, float] = _ESC
    must: tuple[tuple[str, float], ...] = ()


class LogMapping(NamedTuple):
    """Where the signals of a log stand in a file: the first of the entries of a signal that the file has.

    Attributes:
        signals: entries by signal.
        time: column and unit of the time; "" for the time of the messages.
    """

    signals: Mapping[str, tuple[Entry, ...]]
    time: tuple[str, str] = ("", "s")


def mapping_of(data: Any) -> LogMapping:
    """A mapping from plain data, as of a YAML file.

    Raises:
        BadInput: a key is unknown, or has a value that it cannot have; names of keys start at the mapping.
    """
    _keys(data, "", ("time", "world", "body", "signals"), "signals")
    frame = (_word(data, "world", WORLD), _word(data, "body", BODY))
    signals = {}
    with within("signals"):
        if not isinstance(data["signals"], Mapping) or not data["signals"]:
            raise BadInput("", "be a mapping of signals", data["signals"])
        for name, described in data["signals"].items():
            if name not in SIGNALS:
                raise BadInput(str(name), "be a known signal", "unknown", hint=did_you_mean(str(name), SIGNALS))
            with within(str(name)):
                signals[name] = (_entry(name, described, frame),)
        if {"attitude", "quaternion"} <= set(signals):
            raise BadInput("quaternion", "be left out where `attitude` is given", "given too")
    return LogMapping(signals, _time(data.get("time", "")))


def _keys(data: Any, name: str, known: Iterable[str], needed: str) -> None:
    """Check that data is a mapping of known keys that has a needed one."""
    if not isinstance(data, Mapping):
        raise BadInput(name or "mapping", "be a mapping", data)
    for key in data:
        if key not in known:
            raise BadInput(str(key), "be a key here", "unknown", hint=known_key(str(key), known))
    if needed not in data:
        raise BadInput(needed, "be given")


def _word(data: Mapping[str, Any], key: str, allowed: tuple[str, str]) -> str:
    word = data.get(key, allowed[0])
    if word not in allowed:
        raise BadInput(key, f"be {' or '.join(allowed)}", word)
    return word


def _time(given: Any) -> tuple[str, str]:
    if isinstance(given, str):
        return given, "s"
    with within("time"):
        _keys(given, "", ("column", "unit"), "column")
        unit = str(given.get("unit", "s"))
        units.seconds(unit)
        return str(given["column"]), unit


def _entry(name: str, given: Any, frame: tuple[str, str]) -> Entry:
    _keys(given, name, ("columns", "topic", "unit", "world", "body", "supply", *_ESC), "columns")
    columns = given["columns"]
    columns = [columns] if isinstance(columns, str) else columns
    if not isinstance(columns, list | tuple) or not columns or not all(isinstance(one, str) for one in columns):
        raise BadInput("columns", "be names of columns", columns)
    own = {"world": frame[0], "body": frame[1]} | dict(given)
    entry = Entry(
        columns=_spread(columns),
        topic=str(given.get("topic", "")),
        unit=str(given.get("unit", "")),
        frame=(_word(own, "world", WORLD), _word(own, "body", BODY)),
        supply=_number(given, "supply", None),
        esc={key: _number(given, key, usual) for key, usual in _ESC.items()},
    )
    known = SIGNALS[name]
    if known.columns != ("thruster",) and len(entry.columns) != max(1, len(known.columns)):
        must = f"be {max(1, len(known.columns))}: {', '.join(known.columns) or name}"
        raise BadInput("columns", must, f"{len(entry.columns)}")
    _factor(name, entry)
    return entry


def _number(given: Mapping[str, Any], key: str, usual: Any) -> Any:
    value = given.get(key, usual)
    if value is usual:
        return value
    if isinstance(value, bool) or not isinstance(value, int | float) or not 0 < value < np.inf:
        if key != "dead_band" or value != 0:
            raise BadInput(key, "be a positive number", value)
    return float(value)


def _spread(columns: Iterable[str]) -> tuple[str, ...]:
    """`C1..C8` as C1, C2, ..., C8, and `data[0]..data[7]` likewise."""
    found: list[str] = []
    for name in columns:
        first, _, last = name.partition("..")
        begin, end = _NUMBERED.fullmatch(first), _NUMBERED.fullmatch(last)
        if not begin or not end or begin["head"] != end["head"] or begin["tail"] != end["tail"]:
            found.append(name)
            continue
        numbers = range(int(begin["number"]), int(end["number"]) + 1)
        if not 0 < len(numbers) <= _MOST:
            raise BadInput("columns", f"be from 1 to {_MOST} columns", name)
        found += [f"{begin['head']}{number}{begin['tail']}" for number in numbers]
    return tuple(found)


def _factor(name: str, entry: Entry) -> float:
    """Factor of the unit; that of pulses and duties, which become volts, is 1 or that of the duty."""
    known = SIGNALS[name]
    shares = name in _VOLTS and entry.unit in _SHARES
    if shares and entry.supply is None:
        raise BadInput("supply", "be given, V: the input is a share of it", f"{name} in {entry.unit}, without")
    if entry.supply is not None and not shares:
        raise BadInput("supply", f"be left out unless the unit is {', '.join(_SHARES)}", entry.supply)
    if shares:
        return _SHARES[entry.unit]
    if name in _VOLTS and entry.unit == "N":  # of thrusters that are commanded in newtons
        return 1.0
    return units.factor(entry.unit or known.unit, known.unit, name, ("N", *_SHARES) if name in _VOLTS else ())


def log_of(recording: Recording, mapping: LogMapping) -> Log:
    """The log that a mapping makes of what a file holds. Signals none of whose entries the file has are an error.

    Raises:
        BadInput: a topic or a column is missing, a time does not increase, or a frame is not the one named.
    """
    notes, signals = list(recording.notes), {}
    for name, entries in mapping.signals.items():
        with within("signals"), within(name):
            entry = next((one for one in entries if _has(recording, one)), entries[-1])
            topic, table = recording.table(entry.topic)
        used, repeated = cleaned(_timed(table, mapping.time, recording.source) if mapping.time[0] else table)
        if repeated:
            notes.append(f"{topic or 'the file'}: {repeated} samples of the time of the one before are left out")
        with within("signals"), within(name):
            ours, series = _series(name, entry, topic, used, recording)
            signals[ours] = series
    return Log(signals, recording.source, recording.format, tuple(dict.fromkeys(notes)))


def suited(recording: Recording, mapping: LogMapping) -> tuple[LogMapping, tuple[str, ...]]:
    """The mapping without what a file does not have, and a sentence for each topic that has another frame."""
    kept, notes = {}, []
    for name, entries in mapping.signals.items():
        fitting = []
        for entry in entries:
            other = _other_frame(recording, entry) if _has(recording, entry) else ""
            if other:
                notes.append(f"{entry.topic} is not read as {name}: {other}")
            elif _has(recording, entry):
                fitting.append(entry)
        if fitting:
            kept[name] = tuple(fitting)
    return mapping._replace(signals=kept), tuple(notes)


def _has(recording: Recording, entry: Entry) -> bool:
    found = recording.find(entry.topic) if entry.topic else None
    return found is not None and all(column in found[1].fields for column in entry.columns)


def _other_frame(recording: Recording, entry: Entry) -> str:
    """Where a column has not the number that it must have: which one, and what it is. "" where all have."""
    _, table = recording.table(entry.topic)
    for column, number in entry.must:
        values = table.fields.get(column, np.array([np.nan]))
        if (values != number).any():
            return f"its {column} is {values[np.argmax(values != number)]:g}, not {number:g}"
    return ""


def _timed(table: Table, time: tuple[str, str], source: str) -> Table:
    """The table with the time of one of its columns."""
    column, unit = time
    with within("time"):
        values = _column(table, column, source, "column")
    return table._replace(time=np.asarray(values, dtype=float) * units.seconds(unit))


def _column(table: Table, name: str, source: str, key: str = "columns") -> np.ndarray:
    if name not in table.fields:
        raise BadInput(key, f"be in {source}", name, hint=did_you_mean(name, table.fields))
    return table.fields[name]


def _series(name: str, entry: Entry, topic: str, table: Table, recording: Recording) -> tuple[str, Series]:
    """A signal in our unit and frame, and its name: quaternions become an attitude."""
    known, source = SIGNALS[name], recording.source
    columns = [np.asarray(_column(table, column, source), dtype=float) for column in entry.columns]
    values = _factor(name, entry) * np.stack(columns, axis=1)
    unit, ours, titles = known.unit, name, known.columns
    if known.columns == ("thruster",):
        titles = thruster_columns(len(columns))
        unit = "N" if entry.unit == "N" else unit
        if name in _VOLTS and entry.supply is not None:
            values = volts(values, entry, entry.supply)
    elif known.kind == "quaternion":
        ours, unit, titles = "attitude", "rad", SIGNALS["attitude"].columns
        values = frames.attitudes_of_quaternions(values, *entry.frame)
    else:
        values = _in_our_frame(values, known, entry.frame)
    shown = f"{topic} " if topic else ""
    used = entry.unit or known.unit
    origin = f"{shown}{', '.join(entry.columns)} ({used}{_frame_note(known, entry.frame)})"
    return ours, Series(table.time, values[:, 0] if not titles else values, titles, unit, SIGNALS[ours].meaning, origin)


def _in_our_frame(values: np.ndarray, known: Known, frame: tuple[str, str]) -> np.ndarray:
    world, body = frame
    if known.kind == "world":
        return frames.world_vectors(values, world)
    if known.kind == "body":
        return frames.body_vectors(values, body)
    if known.kind == "attitude":
        return frames.attitudes(values, world, body)
    return -values if known.kind == "down" and world == "ENU" else values


def _frame_note(known: Known, frame: tuple[str, str]) -> str:
    shown = {"world": frame[0], "body": frame[1], "down": "up" if frame[0] == "ENU" else "down", "": ""}
    note = shown.get(known.kind, f"{frame[1]} in {frame[0]}")
    return f", {note}" if note else ""


def volts(commands: np.ndarray, entry: Entry, supply: float) -> np.ndarray:
    """Volts of pulses in us, as `ESC.voltage` has them: the share of the supply beyond the dead band; or of a duty."""
    if entry.unit == "us":
        offset = commands - entry.esc["neutral"]
        commands = np.where(np.abs(offset) > entry.esc["dead_band"], offset / entry.esc["span"], 0.0)
    return np.clip(commands, -1.0, 1.0) * supply
