"""Commands that start from nothing: a scenario, and one run of it."""

import dataclasses
from pathlib import Path
from typing import Annotated, ClassVar

import typer

from undertow.cli.commands.command import Command
from undertow.cli.commands.options import AllowCode, Overwrite, Pdf, ScenarioFile


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


@dataclasses.dataclass(frozen=True)
class SimulateCommand(Command):
    """Simulate one scenario.

    The command writes run.nc, metrics.json, scenario.yaml, run.mcap, figures/ and run.html when the run has ended.
    run.mcap holds the series for Foxglove and other viewers. run.html holds metrics, figures and a replay in three
    dimensions, and needs no network. If SCENARIO is a result file, its run is repeated, and the command reports whether
    the results are identical bit for bit. Other files in DIR are not changed.
    """

    runs: ClassVar = "undertow.cli.simulate:simulate"
    scenario: ScenarioFile
    out: Annotated[
        Path | None,
        typer.Option(
            metavar="DIR",
            help="Folder for the results. Default: runs/NAME for NAME.yaml, or the next free runs/NAME-2, ...",
        ),
    ] = None
    overwrite: Overwrite = False
    prediction: Annotated[
        bool | None,
        typer.Option(
            "--prediction/--no-prediction",
            help="Also predict the steady-state metrics from the linearised closed loop and compare. Default: where "
            "the run can have a prediction; --prediction says why it has none.",
            show_default=False,
        ),
    ] = None
    allow_code: AllowCode = False
    pdf: Pdf = None
    rerun: Annotated[
        Path | None,
        typer.Option(metavar="FILE.rrd", help="Also write the run for the viewer Rerun. It needs the extra `viz`."),
    ] = None


COMMANDS = (InitCommand, SimulateCommand)
