"""`undertow list` and `undertow describe`: available parts, and one part, kind of file, the metrics or the signals."""

import json
from collections.abc import Mapping

from pydantic import BaseModel
from rich.console import Console
from rich.table import Column, Table

from undertow.analysis.metrics import MEANINGS, PER_AXIS
from undertow.cli.options.describe import DescribeCommand, ListCommand
from undertow.cli.tables import titled, wide_console
from undertow.core import catalogue
from undertow.core.errors import BadInput, did_you_mean
from undertow.core.signals import Signal
from undertow.physics.faults.kinds import list_kinds, severity_cells
from undertow.scenario import describing
from undertow.scenario.describing import text_of
from undertow.scenario.json_schema import scenario_schema
from undertow.scenario.schema import Scenario
from undertow.scenario.schema_keys import keys
from undertow.simulation.loop.recorded_signals import RECORDED
from undertow.studies.campaign.campaign_schema import SECTIONS, Campaign, campaign_json_schema

_SCHEMAS = {"scenario": scenario_schema, "campaign": campaign_json_schema}

_PARTS = (
    "A part is given by its name, such as `thruster: t200`, or with options, such as `thruster: {kind: t200, supply: "
    "16}`. `undertow list` shows the names, `undertow describe t200` the options of one, `undertow describe "
    "hybrid_vehicle` those of a vehicle with thrusters."
)


def describe(command: DescribeCommand) -> None:
    """Print the description of a part, the keys of a scenario or campaign, the metrics, or the signals of every run.

    With `json_schema`, print the keys as a JSON schema.
    """
    console, name = wide_console(), command.name
    if command.json_schema:
        if name not in _SCHEMAS:
            raise BadInput("--json-schema", f"follow `describe {' or '.join(_SCHEMAS)}`", f"given for `{name}`")
        print(json.dumps(_SCHEMAS[name](), indent=1))
    elif name == "scenario":
        _show_keys(console, "Scenario", Scenario)
        console.print(_PARTS, highlight=False, soft_wrap=True)
    elif name == "campaign":
        _show_keys(console, "Campaign", Campaign)
        for section, model in SECTIONS.items():
            _show_keys(console, f"Keys of {section}", model)
    elif name == "metrics":
        rows = [
            (key, metric.unit.replace("[axis]", "[output]"), PER_AXIS.get(key, ""), metric.meaning)
            for key, metric in MEANINGS.items()
        ]
        _show_table(console, "Metrics", ("metric", "unit", "of each output", "meaning"), rows)
    elif name == "signals":
        _show_signals(console, "Signals of every run; see `undertow describe NAME` for those of a part", RECORDED)
    else:
        for description in describing.describe(name):
            _show_part(console, description)


def _show_keys(console: Console, title: str, model: type[BaseModel]) -> None:
    rows = [(key.path, key.type, text_of(key.default), key.meaning) for key in keys(model)]
    _show_table(console, title, ("key", "type", "default", "meaning"), rows)


def _show_part(console: Console, part: describing.Description) -> None:
    console.print(f"{part.title} ({part.kind})" if part.kind else part.title, style="bold", highlight=False)
    console.print(part.summary, highlight=False)
    if part.options:
        rows = [(option.name, text_of(option.default), option.meaning) for option in part.options]
        _show_table(console, "Options", ("option", "default", "meaning"), rows)
    if part.parameters:
        rows = [(p.name, text_of(p.value), p.unit, p.symbol, p.meaning, p.source) for p in part.parameters]
        _show_table(console, "Parameters", ("parameter", "value", "unit", "symbol", "meaning", "source"), rows)
    if part.signals:
        _show_signals(console, "Signals", part.signals)
    for sentence in part.advice:
        console.print(f"Advice: {sentence}", highlight=False)


def _show_signals(console: Console, title: str, declared: Mapping[str, Signal]) -> None:
    rows = [
        (name, ", ".join(("time", *signal.dimensions)), signal.unit, signal.meaning)
        for name, signal in declared.items()
    ]
    _show_table(console, title, ("signal", "dimensions", "unit", "meaning"), rows)


def _show_table(console: Console, title: str, columns: tuple[str, ...], rows: list[tuple[str, ...]]) -> None:
    table = titled(title, *(Column(name, overflow="fold") for name in columns))
    for row in rows:
        table.add_row(*row)
    console.print(table)


def list_parts(command: ListCommand) -> None:
    """Print the parts of one kind, or of all kinds, with one line each; of faults every pair of target and mode."""
    kind, as_json = command.kind, command.as_json
    if kind is not None and kind not in catalogue.KINDS:
        raise BadInput("KIND", "be a kind of part", kind, hint=did_you_mean(kind, catalogue.KINDS))
    if kind == "faults":
        _list_faults(as_json)
        return
    shown_kinds = (kind,) if kind else catalogue.KINDS
    if as_json:
        rows = [
            {"kind": part_kind, "name": name, "description": sentence}
            for part_kind in shown_kinds
            for name, sentence in describing.listed(part_kind)
        ]
        print(json.dumps(rows, indent=1))
        return
    table = Table("kind", "name", "description")
    for part_kind in shown_kinds:
        for name, sentence in describing.listed(part_kind):
            table.add_row(part_kind, name, sentence)
        table.add_section()
    console = wide_console()
    console.print(table)
    console.print("`undertow describe NAME` shows one of them with its options.", highlight=False, soft_wrap=True)


def _list_faults(as_json: bool) -> None:
    """Print every kind of fault: target, mode, and the severity with its unit, default and range."""
    faults = list_kinds()
    if as_json:
        print(json.dumps([fault._asdict() for fault in faults], indent=1))
        return
    table = Table("target", "mode", "severity", "unit", "default", "range")
    for i, fault in enumerate(faults):
        table.add_row(fault.target, fault.mode, *severity_cells(fault))
        if faults[i + 1 : i + 2] and faults[i + 1].target != fault.target:
            table.add_section()
    console = wide_console()
    console.print(table)
    console.print(
        f"{len(faults)} kinds. `undertow describe faults/NAME` shows the options of a mode.",
        highlight=False,
        soft_wrap=True,
    )
