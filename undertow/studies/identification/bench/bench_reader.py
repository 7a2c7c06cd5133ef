"""Reads records of a test bench: CSV files by the words of their header, other logs by a mapping."""

from pathlib import Path

import numpy as np

from undertow.core.errors import BadInput
from undertow.logs.csv_reader import read_csv
from undertow.logs.log import Log
from undertow.logs.recording import Recording, TopicMessages
from undertow.physics.power.esc import esc
from undertow.scenario.log_file import read_log
from undertow.studies.identification.bench.bench_table import BenchTable, Rows
from undertow.studies.identification.bench.columns import BenchColumn, columns_of

_SUPPLY_TOLERANCE = 0.03  # of the supply, within which a row counts as one of it
_SLOWEST = 0.3  # s between rows that show a lag
_PULSES = (700.0, 2400.0)  # us
_FULL_DUTY = 1.05
_REVERSAL = 0.5  # s after a change of sign in which a motor may still turn the other way
_FEWEST = 20  # rows over time
_NEGATIVE = 0.02  # share of the largest thrust, from which on a thrust counts as one in reverse
_COMMANDS = ("pulse", "duty", "command", "voltage")


def read_bench(path: Path, supply: float | None = None, mapping: Path | None = None) -> BenchTable:
    """The record in a file.

    Args:
        path: a CSV file whose header names quantities and units; or any log, with a mapping where it needs one.
        supply: V, of pulses and duties where the file has no column of it; otherwise only rows at this supply are read.
        mapping: which columns are `input`, `thrust` and `propeller_speed`.

    Raises:
        BadInput: no such file, columns that are missing or have no unit, or commands that are none.
    """
    if not path.is_file():
        raise BadInput("bench", "be an existing file", str(path))
    is_plain_table = path.suffix.lower() == ".csv" and mapping is None
    source = read_csv(path) if is_plain_table else read_log(path, mapping)
    table = _of_recording(source, supply) if isinstance(source, Recording) else _of_log(source)
    return _with_signs(_with_time(table))


# Tables of named columns.


def _of_recording(recording: Recording, supply: float | None) -> BenchTable:
    _, fields = recording.table("")
    columns = columns_of(fields.fields)
    for quantity, column in columns_of(fields.texts).items():
        if quantity not in columns:
            raise BadInput("bench", f"hold numbers in the column of {quantity}", fields.texts[column.name])
    command = next((quantity for quantity in _COMMANDS if quantity in columns), "")
    for quantity, example in (("thrust", "thrust_N"), (command, "pwm_us, duty or voltage_V")):
        if quantity not in columns:
            missing = quantity or "the command"
            hint = "Or name columns with --mapping"
            got = f"{recording.source} with {', '.join(fields.fields)}"
            raise BadInput("bench", f"have a column of {missing}, such as {example}", got, hint=hint)
    values = {quantity: _values(fields, column) for quantity, column in columns.items() if quantity != "command"}
    empty = np.full(len(fields.time), np.nan)
    if command == "voltage":
        volts = values["voltage"]
        duty, supplies = np.ones(len(volts)), np.full(len(volts), np.nanmax(np.abs(volts)))
    else:
        supplies = _supplies(values, empty, supply, recording.source)
        share = _duty(command, fields.fields[columns[command].name] if command == "command" else values[command])
        volts, duty = share * supplies, np.abs(share)
    current = values.get("current", values["power"] / supplies if "power" in values else empty)
    table = BenchTable(
        recording.source,
        volts,
        duty,
        values["thrust"],
        current,
        values.get("speed", empty),
        supplies,
        values.get("time"),
        recording.notes,
    )
    usable = np.isfinite(volts) & np.isfinite(table.thrust)
    return _at_supply(table.rows(usable), supply) if command != "voltage" else table.rows(usable)


def _values(table: TopicMessages, column: BenchColumn) -> Rows:
    return np.asarray(table.fields[column.name], dtype=float) * column.factor


def _supplies(values: dict[str, Rows], empty: Rows, supply: float | None, source: str) -> Rows:
    """Supply of each row, V."""
    measured = values.get("supply", values.get("voltage"))
    if measured is not None:
        return measured
    if supply is None:
        hint = "Give it with --supply, in V"
        raise BadInput("bench", "have a column of the supply: pulses and duties are shares of it", source, hint=hint)
    return np.full(len(empty), supply)


def _duty(quantity: str, command: Rows) -> Rows:
    """Share of the supply that a command is."""
    low, high = float(np.nanmin(command)), float(np.nanmax(command))
    spread = f"from {low:g} to {high:g}"
    if quantity == "pulse" or (quantity == "command" and low > _PULSES[0] and high < _PULSES[1]):
        if low < _PULSES[0] or high > _PULSES[1]:
            must = f"hold pulses from {_PULSES[0]:g} to {_PULSES[1]:g} us"
            raise BadInput("bench", must, spread, hint="Or name the column duty or voltage_V")
        controller = esc()
        return np.clip((command - float(controller.neutral)) / float(controller.span), -1.0, 1.0)
    if max(-low, high) > _FULL_DUTY:
        hint = "Name the column duty_%, pwm_us or voltage_V"
        raise BadInput("bench", "hold duties from -1 to 1", spread, hint=hint)
    return np.clip(command, -1.0, 1.0)


def _at_supply(table: BenchTable, supply: float | None) -> BenchTable:
    """The rows of a supply; all without one."""
    if supply is None:
        return table
    near = np.abs(table.supply - supply) <= _SUPPLY_TOLERANCE * supply
    if not near.any():
        supplies = ", ".join(f"{value:g}" for value in np.unique(np.round(table.supply, 1))[:8])
        raise BadInput("--supply", f"be one of {table.name}: {supplies} V", f"{supply:g} V")
    return table.rows(near)


# Logs of undertow and of other programs.


def _of_log(log: Log) -> BenchTable:
    for name in ("input", "thrust"):
        if name not in log:
            raise BadInput("bench", f"have the signal {name}", f"{log.source} with {', '.join(log.signals)}")
        if np.ndim(log[name].values) > 1 and np.shape(log[name].values)[1] != 1:
            got = f"{name} of {np.shape(log[name].values)[1]}"
            raise BadInput("bench", "be of one thruster", got, hint="Name its columns in --mapping")
    if log["input"].unit != "V":
        raise BadInput("bench", "have the input in V, or in pulses or duties with a supply", log["input"].unit)
    thrust = log["thrust"]
    time = np.asarray(thrust.time, dtype=float)
    held = np.clip(np.searchsorted(log["input"].time, time, side="right") - 1, 0, None)
    volts = np.ravel(log["input"].values)[held]
    empty = np.full(len(time), np.nan)
    speed = empty
    if "propeller_speed" in log:
        series = log["propeller_speed"]
        speed = np.interp(time, series.time, np.ravel(series.values))
    counted = log.format == "CSV" and np.array_equal(time, np.arange(len(time)))  # a table without a time
    return BenchTable(
        log.source,
        volts,
        np.ones(len(time)),
        np.ravel(thrust.values),
        empty,
        speed,
        np.full(len(time), np.abs(volts).max()),
        None if counted else time,
        log.notes,
    )


# Time and signs.


def _with_time(table: BenchTable) -> BenchTable:
    """The table with its time where that shows how thrust follows the command, and without it otherwise."""
    if table.time is None:
        return table
    time = table.time - table.time[0]
    steps = np.diff(time)
    if len(time) < _FEWEST or not (steps > 0).all():
        note = "its times do not increase, so that its rows are taken as settled"
        return table._replace(time=None, notes=(*table.notes, note) if len(time) >= _FEWEST else table.notes)
    interval = float(np.median(steps))
    if interval > _SLOWEST:
        note = f"its rows are {interval:.3g} s apart, too far to show a lag, and are taken as settled"
        return table._replace(time=None, notes=(*table.notes, note))
    return table._replace(time=time)


def _with_signs(table: BenchTable) -> BenchTable:
    """The table with current, speed and thrust in the sign of the command, where they are given as sizes."""
    sign = np.sign(table.volts)
    signs = np.where(_reversing(table), np.nan, sign)
    signed = {name: _signed(getattr(table, name), sign, signs, table.time) for name in ("current", "speed")}
    table = table._replace(**signed)
    if table.time is not None or not (sign < 0).any() or not (sign > 0).any():
        return table
    least = -_NEGATIVE * float(np.abs(table.thrust).max())
    if table.thrust.min() < least:
        return table
    note = "thrust has no sign: in reverse it is taken as negative"
    return table._replace(thrust=np.where(sign < 0, -1.0, 1.0) * table.thrust, notes=(*table.notes, note))


def _signed(values: Rows, sign: Rows, signs: Rows, time: Rows | None) -> Rows:
    """Sizes in the sign of the command, those of settled rows always; NaN where the motor may still turn back."""
    has_own_signs = time is not None and bool((values < 0).any())
    return values if has_own_signs else np.abs(values) * (sign if time is None else signs)


def _reversing(table: BenchTable) -> np.ndarray:
    """Rows of a record shortly after the command has changed its sign, (rows,)."""
    rows = np.zeros(len(table.volts), dtype=bool)
    if table.time is not None:
        for change in table.time[1:][np.diff(np.sign(table.volts)) != 0]:
            rows |= (table.time >= change) & (table.time <= change + _REVERSAL)
    return rows
