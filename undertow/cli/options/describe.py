"""Options of `undertow list` and `undertow describe`."""

import dataclasses
from pathlib import Path
from typing import Annotated, ClassVar

import typer

from undertow.cli.options.command import Command


@dataclasses.dataclass(frozen=True)
class ListCommand(Command):
    """List the available parts.

    Kinds: vehicles, thrusters, power, plants, controllers, disturbances, references, sensors, navigation, faults.
    `undertow list faults` shows every pair of target and mode, with the meaning of its severity.
    """

    runs: ClassVar = "undertow.cli.describe:list_parts"
    named: ClassVar = "list"
    kind: Annotated[str | None, typer.Argument(metavar="[KIND]", help="One kind only, e.g. thrusters.")] = None
    as_json: Annotated[
        bool, typer.Option("--json", help="Print JSON instead of a table: with faults every target and mode.")
    ] = False

    def keeps_answer(self) -> bool:
        return True


@dataclasses.dataclass(frozen=True)
class DescribeCommand(Command):
    """Describe a part.

    The command shows the options of the part, its parameters with unit, symbol and source, and advice. `describe
    scenario` shows the keys of a scenario file, `describe campaign` those of a campaign file, `describe metrics` the
    metrics with their units.
    """

    runs: ClassVar = "undertow.cli.describe:describe"
    name: Annotated[
        str,
        typer.Argument(
            metavar="NAME",
            help="A part (see `undertow list`), ./file.py:function, a vehicle file, or one of the words scenario, "
            "campaign, metrics and signals.",
        ),
    ]
    json_schema: Annotated[
        bool,
        typer.Option("--json-schema", help="With NAME scenario or campaign: print the JSON schema that editors use."),
    ] = False

    def keeps_answer(self) -> bool:
        return self.name.isidentifier() and not Path(self.name).exists()
