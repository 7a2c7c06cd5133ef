"""Series as JSON messages with named fields and units, and back, bit for bit.

Signals of one group that were sampled together are one message per sample:

    {"time": 0.05, "position": {"north": 1.25, "east": 0.5, ...}, "velocity": {...}}

JSON has no numbers that are not finite: NaN is null, and infinite ones are the words "Infinity" and "-Infinity".
"""

import json
from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np

from undertow.logs.log_signals import Series

# Signals by group; those that are named nowhere belong to `controller`.
GROUPS = {
    "motion": (
        "position velocity measured_position measured_velocity reference error "
        "attitude body_velocity angular_velocity specific_force depth"
    ).split(),
    "thrusters": "input commanded_input power saturated thrust pulses duty propeller_speed".split(),
}

_NOT_FINITE = {"Infinity": np.inf, "-Infinity": -np.inf, None: np.nan}
_OUR_SCHEMA = "undertow."


def group_of(name: str) -> str:
    """Group of a signal: `motion`, `thrusters` (with their energy) or `controller`."""
    if name.startswith("energy_"):
        return "thrusters"
    return next((group for group, names in GROUPS.items() if name in names), "controller")


def grouped(signals: Mapping[str, Series]) -> dict[str, dict[str, Series]]:
    """Signals by topic: those of a group that were sampled together, or each for itself where they were not."""
    groups: dict[str, dict[str, Series]] = {}
    for name, series in signals.items():
        topic = f"/{group_of(name)}"
        first = next(iter(groups.get(topic, {}).values()), series)
        if first.time.shape != series.time.shape or (first.time != series.time).any():
            topic = f"{topic}/{name}"
        groups.setdefault(topic, {})[name] = series
    return groups


class MessageForm:
    """Form of the messages of a group.

    Args:
        group: name.
        signals: of the group; only columns, shapes, units, types and meanings matter.
    """

    def __init__(self, group: str, signals: Mapping[str, Series]):
        self.schema_name = _OUR_SCHEMA + group
        self._signals = dict(signals)
        parts = ", ".join(f"{_key(name)}: {_template(series)}" for name, series in signals.items())
        self._template = '{"time": %r, ' + parts + "}"

    def schema(self) -> str:
        """JSON schema of the messages; `unit`, `description` and `origin` are ours."""
        properties: dict[str, Any] = {"time": {"type": "number", "unit": "s", "description": "time"}}
        for name, series in self._signals.items():
            annotations = {"unit": series.unit, "description": series.meaning, "origin": series.origin}
            inner = _number_schema(series.values.dtype, series.values.shape[2:])
            if series.values.ndim > 1:
                inner = {"type": "object", "properties": dict.fromkeys(_columns(series), inner)}
            properties[name] = inner | {key: text for key, text in annotations.items() if text}
        return json.dumps({"title": self.schema_name, "type": "object", "properties": properties})

    def of_sample(self, time: float, values: list[Any]) -> bytes:
        """The message of one sample: the numbers of all signals, flattened, in their order."""
        finite = np.isfinite(values).all()
        return (self._template % (time, *values) if finite else self._with_words(time, values)).encode()

    def of_samples(self) -> Iterator[tuple[float, bytes]]:
        """Time and message of each sample of the signals."""
        first = next(iter(self._signals.values()))
        matrix = np.concatenate([series.flat().astype(float) for series in self._signals.values()], axis=1)
        finite = np.atleast_1d(np.isfinite(matrix).all(axis=1))
        for is_finite, time, row in zip(finite, first.time.tolist(), matrix.tolist(), strict=True):
            yield time, (self._template % (time, *row) if is_finite else self._with_words(time, row)).encode()

    def _with_words(self, time: float, values: list[float]) -> str:
        """The message of a sample that has numbers that are not finite."""
        words = {np.inf: '"Infinity"', -np.inf: '"-Infinity"'}
        template = self._template.replace("%d", "%r")  # integers are always finite, but share the row
        printed = [
            _Word("null") if value != value else _Word(words[value]) if value in words else value for value in values
        ]
        return template % (time, *printed)


class _Word:
    """Text that `%r` shows as it is."""

    def __init__(self, text: str):
        self._text = text

    def __repr__(self) -> str:
        return self._text


def _columns(series: Series) -> tuple[str, ...]:
    number = series.values.shape[1]
    return series.columns if len(series.columns) == number else tuple(str(i + 1) for i in range(number))


def _template(series: Series) -> str:
    """Template of the numbers of a sample; `%r` of a float is the shortest text that reads back as the same number."""
    number = "%d" if series.values.dtype.kind in "iub" else "%r"
    if series.values.ndim == 1:
        return number
    inner = _list_template(number, series.values.shape[2:])
    return "{" + ", ".join(f"{_key(name)}: {inner}" for name in _columns(series)) + "}"


def _key(name: str) -> str:
    """A name in a template."""
    return json.dumps(name).replace("%", "%%")


def _list_template(number: str, shape: tuple[int, ...]) -> str:
    if not shape:
        return number
    return "[" + ", ".join([_list_template(number, shape[1:])] * shape[0]) + "]"


def _number_schema(dtype: np.dtype, shape: tuple[int, ...]) -> dict[str, Any]:
    if not shape:
        return {"type": "integer" if dtype.kind in "iub" else "number"}
    return {"type": "array", "items": _number_schema(dtype, shape[1:])}


def is_ours(schema_name: str) -> bool:
    """Whether messages of a schema have the form of `MessageForm`."""
    return schema_name.startswith(_OUR_SCHEMA)


def signals_of(schema: Mapping[str, Any], messages: list[Mapping[str, Any]]) -> dict[str, Series]:
    """Signals of the messages of one topic in our form, with the schema that describes them.

    Raises:
        KeyError, TypeError, ValueError, AttributeError: the messages have another form.
    """
    time = np.array([number(message["time"]) for message in messages])
    signals = {}
    for name, signal_schema in schema["properties"].items():
        if name == "time":
            continue
        columns = tuple(signal_schema.get("properties", ()))
        rows = [[message[name][column] for column in columns] if columns else message[name] for message in messages]
        values = _array(rows, _type(signal_schema))
        texts = (signal_schema.get("unit", "1"), signal_schema.get("description", ""), signal_schema.get("origin", ""))
        signals[name] = Series(time, values, columns, *map(str, texts))
    return signals


def _type(number_schema: Mapping[str, Any]) -> type:
    """Type of the numbers that a schema describes, within its objects and arrays."""
    while number_schema.get("type") in ("object", "array"):
        inner = (
            number_schema.get("properties", {}).values()
            if number_schema["type"] == "object"
            else [number_schema["items"]]
        )
        number_schema = next(iter(inner), {})
    return int if number_schema.get("type") == "integer" else float


def _array(rows: list[Any], kind: type) -> np.ndarray:
    """Nested lists of numbers, among which words may stand for those that are not finite."""
    try:
        return np.array(rows, dtype=kind)
    except (TypeError, ValueError):  # words
        return np.array(_numbers(rows), dtype=float)


def _numbers(value: Any) -> Any:
    return [_numbers(entry) for entry in value] if isinstance(value, list) else number(value)


def number(value: Any) -> float:
    """A number of a message.

    Raises:
        TypeError: it is something else.
    """
    if value is None or isinstance(value, str):
        if value not in _NOT_FINITE:
            raise TypeError(f"{value!r} is no number")
        return _NOT_FINITE[value]
    return float(value)
