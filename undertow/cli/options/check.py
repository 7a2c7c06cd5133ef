"""Options of `undertow check`."""

import dataclasses
from typing import Annotated, ClassVar

import typer

from undertow.cli.options.command import Command
from undertow.cli.options.shared import AllowCode


@dataclasses.dataclass(frozen=True)
class CheckCommand(Command):
    """Check a vehicle, another part, a scenario or a campaign.

    The command reports errors and advice, each with the numbers that caused it, and quantities derived from the
    parameters. The exit code is 2 if there are errors.
    """

    runs: ClassVar = "undertow.cli.check:check"
    thing: Annotated[
        str,
        typer.Argument(
            metavar="THING", help="A vehicle file, a scenario, a campaign, a part by name, or ./file.py:function."
        ),
    ]
    option: Annotated[
        list[str] | None,
        typer.Option(
            "--option", metavar="KEY=VALUE", help="Option of the part, for example parameters=wu2018. Repeatable."
        ),
    ] = None
    allow_code: AllowCode = False
