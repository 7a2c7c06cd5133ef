"""`undertow list` and `undertow describe`: available parts, and one part, the scenario file, metrics or signals."""

import json
from collections.abc import Mapping
from typing import Any

import numpy as np
from rich.console import Console
from rich.table import Column, Table
from rich.text import Text

from undertow.analysis.metrics import MEANINGS, PER_AXIS
from undertow.cli.tables import titled, wide_console
from undertow.core import catalogue
from undertow.core.errors import BadInput, did_you_mean
from undertow.core.signals import Signal
from undertow.loop.recorded_signals import RECORDED
from undertow.scenario import describing
from undertow.scenario.describing import summary
from undertow.scenario.json_schema import scenario_schema
from undertow.scenario.schema import keys


def describe(name: str, json_schema: bool = False) -> None:
    """Print the description of a part, the keys of a scenario, the metrics, or the signals of every run.

    With `json_schema`, print the keys of a scenario as a JSON schema.
    """
    console = wide_console()
    if json_schema:
        if name != "scenario":
            raise BadInput("--json-schema", "follow `describe scenario`", f"given for `{name}`")
        print(json.dumps(scenario_schema(), indent=1))
    elif name == "scenario":
        rows = [(key.path, key.type, _text(key.default), key.meaning) for key in keys()]
        _show_table(console, "Scenario", ("key", "type", "default", "meaning"), rows)
    elif name == "metrics":
        rows = [
            (key, one.unit.replace("[axis]", "[output]"), PER_AXIS.get(key, ""), one.meaning)
            for key, one in MEANINGS.items()
        ]
        _show_table(console, "Metrics", ("metric", "unit", "of each output", "meaning"), rows)
    elif name == "signals":
        _show_signals(console, "Signals of every run; see `undertow describe NAME` for those of a part", RECORDED)
    else:
        for description in describing.describe(name):
            _show_part(console, description)


def _show_part(console: Console, part: describing.Description) -> None:
    console.print(Text(f"{part.name} {part.kind}".rstrip(), style="bold"))
    console.print(Text(part.summary))
    if part.options:
        rows = [(option.name, _text(option.default), option.meaning) for option in part.options]
        _show_table(console, "Options", ("option", "default", "meaning"), rows)
    if part.parameters:
        rows = [(p.name, _text(p.value), p.unit, p.symbol, p.meaning, p.source) for p in part.parameters]
        _show_table(console, "Parameters", ("parameter", "value", "unit", "symbol", "meaning", "source"), rows)
    if part.signals:
        _show_signals(console, "Signals", part.signals)
    for sentence in part.advice:
        console.print(Text(f"Advice: {sentence}"))


def _show_signals(console: Console, title: str, declared: Mapping[str, Signal]) -> None:
    rows = [(name, ", ".join(("time", *one.dimensions)), one.unit, one.meaning) for name, one in declared.items()]
    _show_table(console, title, ("signal", "dimensions", "unit", "meaning"), rows)


def _show_table(console: Console, title: str, columns: tuple[str, ...], rows: list[tuple[str, ...]]) -> None:
    table = titled(title, *(Column(name, overflow="fold") for name in columns))
    for row in rows:
        table.add_row(*map(Text, row))
    console.print(table)


def _text(value: Any) -> str:
    """A short text for a value; a diagonal matrix is shown as its diagonal."""
    if isinstance(value, str) or value is None:
        return "none" if value is None else value
    if isinstance(value, bool) or not isinstance(value, int | float | list | tuple):
        return str(value).lower()
    if isinstance(value, list | tuple) and any(isinstance(entry, str) for entry in value):
        return ", ".join(value)
    array = np.asarray(value, dtype=float)
    if array.ndim == 0:
        return f"{array:.6g}"
    if array.ndim == 2 and array.shape[0] == array.shape[1] and not np.any(array - np.diag(np.diag(array))):
        return f"diag{_row(np.diag(array))}"
    return "\n".join(map(_row, np.atleast_2d(array)))


def _row(entries: np.ndarray) -> str:
    return f"({', '.join(f'{entry:.6g}' for entry in entries)})"


def list_parts(kind: str | None) -> None:
    """Print the parts of one kind, or of all kinds, with one line each."""
    if kind is not None and kind not in catalogue.KINDS:
        raise BadInput("KIND", "be a kind of part", kind, hint=did_you_mean(kind, catalogue.KINDS))
    table = Table("kind", "name", "description")
    for shown in (kind,) if kind else catalogue.KINDS:
        for name, part in sorted(catalogue.names(shown).items()):
            table.add_row(shown, name, Text(summary(part)))
        table.add_section()
    wide_console().print(table)
