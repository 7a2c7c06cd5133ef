"""A mapping: which columns of a file are which signal, in which unit and frame.

time: {column: time_ms, unit: ms}
world: ENU
signals:
  position: {columns: [x, y, z]}
  attitude: {columns: [roll, -pitch, yaw], unit: deg}
  input: {columns: [pwm1, pwm2, pwm3, -pwm4], unit: us, supply: 16}

In a log of ArduSub an input may be `{frame: vectored_6dof, unit: us, supply: 16}`: each thruster is then the motor of
that frame that pushes as it does.
"""

import re
from collections.abc import Iterable, Mapping
from typing import Any, NamedTuple

import numpy as np

from undertow.core.errors import BadInput, did_you_mean, error_location, known_key
from undertow.logs import units
from undertow.logs.ardusub_frames import FRAMES
from undertow.logs.known_signals import BODY, SIGNALS, WORLD

# Pulses and duties become volts with these, as `undertow describe esc` has them.
_ESC = {"neutral": 1500.0, "span": 400.0, "dead_band": 25.0}

# Signals that may be given as a share of the supply, and the units of a share with their factor.
INPUTS, SHARES = ("input", "commanded_input"), {"us": 1.0, "1": 1.0, "%": 0.01}

_NUMBERED = re.compile(r"(?P<head>.*?)(?P<number>\d{1,4})(?P<tail>\D*)")
_MOST = 64  # columns of a signal


class SignalMapping(NamedTuple):
    """Where a signal stands in a file.

    Attributes:
        columns: of the file, in our order.
        topic: whose columns they are, or the type of its messages; "" for the only one.
        unit: of the columns; "" for ours.
        frame: world and body axes of the file.
        supply: V, for inputs given as pulses or duty.
        esc: neutral, span and dead band of pulses, us.
        must: columns and the number that they must have throughout, such as that of a frame.
        signs: -1 for each column that stands for its negative, else 1; () for 1 throughout.
        motors: frame of ArduSub whose motors the columns are, in their order; "" for none. Without columns they are
            those of the motors in the file.
    """

    columns: tuple[str, ...]
    topic: str = ""
    unit: str = ""
    frame: tuple[str, str] = ("NED", "FRD")
    supply: float | None = None
    esc: Mapping[str, float] = _ESC
    must: tuple[tuple[str, float], ...] = ()
    signs: tuple[int, ...] = ()
    motors: str = ""


class LogMapping(NamedTuple):
    """Where the signals of a log stand in a file: the first of the entries of a signal that the file has.

    Attributes:
        signals: entries by signal.
        time: column and unit of the time; "" for the time of the messages.
    """

    signals: Mapping[str, tuple[SignalMapping, ...]]
    time: tuple[str, str] = ("", "s")


def mapping_of(data: Any) -> LogMapping:
    """A mapping from plain data, as of a YAML file.

    Raises:
        BadInput: a key is unknown, or has a value that it cannot have; names of keys start at the mapping.
    """
    _keys(data, "", ("time", "world", "body", "signals"), "signals")
    frame = (_word(data, "world", WORLD), _word(data, "body", BODY))
    signals = {}
    with error_location("signals"):
        if not isinstance(data["signals"], Mapping) or not data["signals"]:
            raise BadInput("", "be a mapping of signals", data["signals"])
        for name, settings in data["signals"].items():
            if name not in SIGNALS:
                raise BadInput(str(name), "be a known signal", "unknown", hint=did_you_mean(str(name), SIGNALS))
            with error_location(str(name)):
                signals[name] = (_entry(name, settings, frame),)
        if {"attitude", "quaternion"} <= set(signals):
            raise BadInput("quaternion", "be left out where `attitude` is given", "given too")
    return LogMapping(signals, _time(data.get("time", "")))


def _keys(data: Any, name: str, allowed: Iterable[str], needed: str) -> None:
    """Check that data is a mapping of known keys that has a needed one."""
    if not isinstance(data, Mapping):
        raise BadInput(name or "mapping", "be a mapping", data)
    for key in data:
        if key not in allowed:
            raise BadInput(str(key), "be a key here", "unknown", hint=known_key(str(key), allowed))
    if needed not in data:
        raise BadInput(needed, "be given")


def _word(data: Mapping[str, Any], key: str, allowed: tuple[str, str]) -> str:
    word = data.get(key, allowed[0])
    if word not in allowed:
        raise BadInput(key, f"be {' or '.join(allowed)}", word)
    return word


def _time(settings: Any) -> tuple[str, str]:
    if isinstance(settings, str):
        return settings, "s"
    with error_location("time"):
        _keys(settings, "", ("column", "unit"), "column")
        unit = str(settings.get("unit", "s"))
        units.seconds(unit)
        return str(settings["column"]), unit


def _entry(name: str, settings: Any, frame: tuple[str, str]) -> SignalMapping:
    motors = isinstance(settings, Mapping) and "frame" in settings and name in INPUTS
    known_keys = ("columns", *(["frame"] if name in INPUTS else []), "topic", "unit", "world", "body", "supply", *_ESC)
    _keys(settings, name, known_keys, "frame" if motors else "columns")
    signed_columns = _columns(settings["columns"]) if not motors or "columns" in settings else []
    with_axes = {"world": frame[0], "body": frame[1]} | dict(settings)
    entry = SignalMapping(
        columns=tuple(column for _, column in signed_columns),
        topic=str(settings.get("topic", "")),
        unit=str(settings.get("unit", "")),
        frame=(_word(with_axes, "world", WORLD), _word(with_axes, "body", BODY)),
        supply=_number(settings, "supply", None),
        esc={key: _number(settings, key, usual) for key, usual in _ESC.items()},
        signs=tuple(sign for sign, _ in signed_columns),
        motors=_frame(settings["frame"], signed_columns) if motors else "",
    )
    signal = SIGNALS[name]
    if signal.columns != ("thruster",) and len(entry.columns) != max(1, len(signal.columns)):
        must = f"be {max(1, len(signal.columns))}: {', '.join(signal.columns) or name}"
        raise BadInput("columns", must, f"{len(entry.columns)}")
    factor_of(name, entry)
    return entry


def _frame(name: Any, columns: list[tuple[int, str]]) -> str:
    """The name of a frame of ArduSub, which has as many motors as there are columns."""
    if not isinstance(name, str) or name not in FRAMES:
        hint = did_you_mean(str(name), FRAMES)
        raise BadInput("frame", f"be a frame of ArduSub, {' or '.join(FRAMES)}", name, hint=hint)
    if columns and len(columns) != len(FRAMES[name]):
        raise BadInput("columns", f"be those of the {len(FRAMES[name])} motors of {name}", f"{len(columns)}")
    return name


def _number(settings: Mapping[str, Any], key: str, usual: Any) -> Any:
    value = settings.get(key, usual)
    if value is usual:
        return value
    if isinstance(value, bool) or not isinstance(value, int | float) or not 0 < value < np.inf:
        if key != "dead_band" or value != 0:
            raise BadInput(key, "be a positive number", value)
    return float(value)


def _columns(columns: Any) -> list[tuple[int, str]]:
    """Sign and name of each column: `-C1` is the negative of C1, and `C1..C8` stands for C1, C2, ..., C8."""
    words = [columns] if isinstance(columns, str) else columns
    if not isinstance(words, list | tuple) or not words or not all(isinstance(word, str) for word in words):
        raise BadInput("columns", "be names of columns", words)
    signed_columns = []
    for word in words:
        negative = word.startswith("-")
        names = _spread(word[1:].replace("..-", "..") if negative else word)
        signed_columns += [(-1 if negative else 1, column) for column in names]
    return signed_columns


def _spread(name: str) -> list[str]:
    """`C1..C8` as C1, C2, ..., C8, and `data[0]..data[7]` likewise."""
    first, _, last = name.partition("..")
    begin, end = _NUMBERED.fullmatch(first), _NUMBERED.fullmatch(last)
    if not begin or not end or begin["head"] != end["head"] or begin["tail"] != end["tail"]:
        return [name]
    numbers = range(int(begin["number"]), int(end["number"]) + 1)
    if not 0 < len(numbers) <= _MOST:
        raise BadInput("columns", f"be from 1 to {_MOST} columns", name)
    return [f"{begin['head']}{number}{begin['tail']}" for number in numbers]


def factor_of(name: str, entry: SignalMapping) -> float:
    """Factor of the unit; that of pulses and duties, which become volts, is 1 or that of the duty."""
    signal = SIGNALS[name]
    shares = name in INPUTS and entry.unit in SHARES
    if shares and entry.supply is None:
        raise BadInput("supply", "be given, V: the input is a share of it", f"{name} in {entry.unit}, without")
    if entry.supply is not None and not shares:
        raise BadInput("supply", f"be left out unless the unit is {', '.join(SHARES)}", entry.supply)
    if shares:
        return SHARES[entry.unit]
    if name in INPUTS and entry.unit == "N":  # of thrusters that are commanded in newtons
        return 1.0
    return units.factor(entry.unit or signal.unit, signal.unit, name, ("N", *SHARES) if name in INPUTS else ())
