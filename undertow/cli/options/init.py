"""Options of `undertow init`."""

import dataclasses
from pathlib import Path
from typing import Annotated, ClassVar

import typer

from undertow.cli.options.command import Command


@dataclasses.dataclass(frozen=True)
class InitCommand(Command):
    """Write a commented scenario to start from.

    The command writes scenario.yaml and scenario.schema.json, with which editors complete and explain its keys. The
    scenario runs as it is: `undertow simulate scenario.yaml`. Existing files are not changed.
    """

    runs: ClassVar = "undertow.cli.init:init"
    path: Annotated[
        Path,
        typer.Argument(metavar="[PATH]", help="Folder for scenario.yaml, or a name that ends in .yaml. Default: here."),
    ] = Path()
    vehicle: Annotated[
        str | None,
        typer.Option(
            metavar="NAME",
            help="Vehicle: bluerov2, bluerov2_heavy (default), odin, rexrov, or a vehicle file of your own.",
        ),
    ] = None
    controller: Annotated[
        str | None, typer.Option(metavar="FILE.py:FUNCTION", help="Controller of your own. Default: pid.")
    ] = None
    own_vehicle: Annotated[
        bool, typer.Option("--own-vehicle", help="Also write my_rov.yaml, a vehicle file for your numbers.")
    ] = False
    own_controller: Annotated[
        bool, typer.Option("--own-controller", help="Also write my_controller.py, a sliding-mode law to change.")
    ] = False
