"""The log that a mapping makes of what a file holds."""

import numpy as np

from undertow.core.errors import BadInput, did_you_mean, error_location
from undertow.logs import frames, units
from undertow.logs.ardupilot_parameters import motor_channels, motor_direction, pulse_columns
from undertow.logs.ardusub_frames import FRAMES, motor_columns
from undertow.logs.known_signals import SIGNALS, KnownSignal, thruster_columns
from undertow.logs.log import Log
from undertow.logs.log_signals import Series
from undertow.logs.mapping import INPUTS, LogMapping, SignalMapping, factor_of
from undertow.logs.recording import Recording, TopicMessages, cleaned


def log_of(recording: Recording, mapping: LogMapping) -> Log:
    """The log that a mapping makes of what a file holds. Signals none of whose entries the file has are an error.

    Raises:
        BadInput: a topic or a column is missing, a time does not increase, or a frame is not the one named.
    """
    notes = list(recording.notes)
    signals = {}
    for name, entries in mapping.signals.items():
        with error_location("signals"), error_location(name):
            entries = tuple(_with_motors(entry, recording) for entry in entries)
            entry = next((candidate for candidate in entries if _has(recording, candidate)), entries[-1])
            topic, table = recording.table(entry.topic)
        cleaned_table, repeated = cleaned(_timed(table, mapping.time, recording.source) if mapping.time[0] else table)
        if repeated:
            notes.append(f"{topic or 'the file'}: {repeated} samples of the time of the one before are left out")
        with error_location("signals"), error_location(name):
            ours, series = _series(name, entry, topic, cleaned_table, recording)
            signals[ours] = series
    return Log(signals, recording.source, recording.format, tuple(dict.fromkeys(notes)))


def _with_motors(entry: SignalMapping, recording: Recording) -> SignalMapping:
    """An entry of motors with their columns in the file and with the directions that its parameters give them.

    Raises:
        BadInput: the file does not say which columns these are.
    """
    if not entry.motors:
        return entry
    numbers = range(1, len(FRAMES[entry.motors]) + 1)
    directions = tuple(motor_direction(recording.parameters, number) for number in numbers)
    if entry.columns:
        return entry._replace(
            signs=tuple(sign * direction for sign, direction in zip(entry.signs, directions, strict=True))
        )
    topic, columns = pulse_columns(recording)
    channels = motor_channels(recording.parameters) or {number: number for number in numbers}  # as ArduSub has it
    names = [columns.get(channels.get(number, 0), "") for number in numbers]
    if not all(names):
        lacking = ", ".join(str(number) for number, name in zip(numbers, names, strict=True) if not name)
        got = f"{entry.motors}, and {recording.source} has no pulses of motor {lacking}"
        hint = f"Give the columns of the motors 1 to {len(numbers)} as well: `columns: [C1..C{len(numbers)}]`"
        raise BadInput("frame", "be that of the vehicle that wrote the log", got, hint=hint)
    return entry._replace(columns=tuple(names), signs=directions, topic=entry.topic or topic)


def suited(recording: Recording, mapping: LogMapping) -> tuple[LogMapping, tuple[str, ...]]:
    """The mapping without what a file does not have, and a sentence for each topic that has another frame."""
    signals, notes = {}, []
    for name, entries in mapping.signals.items():
        suitable = []
        for entry in entries:
            mismatch = _other_frame(recording, entry) if _has(recording, entry) else ""
            if mismatch:
                notes.append(f"{entry.topic} is not read as {name}: {mismatch}")
            elif _has(recording, entry):
                suitable.append(entry)
        if suitable:
            signals[name] = tuple(suitable)
    return mapping._replace(signals=signals), tuple(notes)


def _has(recording: Recording, entry: SignalMapping) -> bool:
    topic_and_table = recording.find(entry.topic) if entry.topic else None
    return topic_and_table is not None and all(column in topic_and_table[1].fields for column in entry.columns)


def _other_frame(recording: Recording, entry: SignalMapping) -> str:
    """Where a column has not the number that it must have: which one, and what it is. "" where all have."""
    _, table = recording.table(entry.topic)
    for column, number in entry.must:
        values = table.fields.get(column, np.array([np.nan]))
        if (values != number).any():
            return f"its {column} is {values[np.argmax(values != number)]:g}, not {number:g}"
    return ""


def _timed(table: TopicMessages, time: tuple[str, str], source: str) -> TopicMessages:
    """The table with the time of one of its columns."""
    column, unit = time
    with error_location("time"):
        values = _column(table, column, source, "column")
    return table._replace(time=np.asarray(values, dtype=float) * units.seconds(unit))


def _column(table: TopicMessages, name: str, source: str, key: str = "columns") -> np.ndarray:
    if name in table.texts:
        raise BadInput(key, "hold numbers", table.texts[name])
    if name not in table.fields:
        raise BadInput(key, f"be in {source}", name, hint=did_you_mean(name, table.fields))
    return table.fields[name]


def _series(
    name: str, entry: SignalMapping, topic: str, table: TopicMessages, recording: Recording
) -> tuple[str, Series]:
    """A signal in our unit and frame, and its name: quaternions become an attitude."""
    signal = SIGNALS[name]
    source = recording.source
    columns = [np.asarray(_column(table, column, source), dtype=float) for column in entry.columns]
    values = factor_of(name, entry) * _signed(np.stack(columns, axis=1), entry, signal)
    unit = signal.unit
    ours = name
    titles = signal.columns
    if signal.columns == ("thruster",):
        titles = motor_columns(entry.motors) if entry.motors else thruster_columns(len(columns))
        unit = "N" if entry.unit == "N" else unit
        if name in INPUTS and entry.supply is not None:
            values = volts(values, entry, entry.supply)
    elif signal.kind == "quaternion":
        ours = "attitude"
        unit = "rad"
        titles = SIGNALS["attitude"].columns
        values = frames.attitudes_of_quaternions(values, *entry.frame)
    else:
        values = _in_our_frame(values, signal, entry.frame)
    topic_prefix = f"{topic} " if topic else ""
    file_unit = entry.unit or signal.unit
    signs_and_columns = zip(entry.signs or [1] * len(entry.columns), entry.columns, strict=True)
    signed_names = ", ".join(f"-{column}" if sign < 0 else column for sign, column in signs_and_columns)
    origin = f"{topic_prefix}{signed_names} ({file_unit}{_frame_note(signal, entry.frame)})"
    return ours, Series(table.time, values[:, 0] if not titles else values, titles, unit, SIGNALS[ours].meaning, origin)


def _signed(values: np.ndarray, entry: SignalMapping, signal: KnownSignal) -> np.ndarray:
    """Values, with the negative of those columns whose sign is -1. The negative of a pulse is as far from neutral."""
    if not entry.signs:
        return values
    pulses = entry.unit == "us" or (signal.unit == "us" and not entry.unit)
    middle = entry.esc["neutral"] if pulses else 0.0
    sent = values != 0.0 if pulses else True  # 0 us is no pulse
    return np.where(sent, middle + np.array(entry.signs) * (values - middle), 0.0)


def _in_our_frame(values: np.ndarray, signal: KnownSignal, frame: tuple[str, str]) -> np.ndarray:
    world, body = frame
    if signal.kind == "world":
        return frames.world_vectors(values, world)
    if signal.kind == "body":
        return frames.body_vectors(values, body)
    if signal.kind == "attitude":
        return frames.attitudes(values, world, body)
    return -values if signal.kind == "down" and world == "ENU" else values


def _frame_note(signal: KnownSignal, frame: tuple[str, str]) -> str:
    notes_by_kind = {"world": frame[0], "body": frame[1], "down": "up" if frame[0] == "ENU" else "down", "": ""}
    note = notes_by_kind.get(signal.kind, f"{frame[1]} in {frame[0]}")
    return f", {note}" if note else ""


def volts(commands: np.ndarray, entry: SignalMapping, supply: float) -> np.ndarray:
    """Volts of pulses in us, as `ESC.voltage` has them: the share of the supply beyond the dead band; or of a duty.

    A pulse of 0 us is none, at which the speed controller stops the motor.
    """
    if entry.unit == "us":
        offset = np.where(commands == 0.0, 0.0, commands - entry.esc["neutral"])
        commands = np.where(np.abs(offset) > entry.esc["dead_band"], offset / entry.esc["span"], 0.0)
    return np.clip(commands, -1.0, 1.0) * supply
