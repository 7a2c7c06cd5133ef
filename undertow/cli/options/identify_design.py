"""Options of `undertow identify-design`."""

import dataclasses
from pathlib import Path
from typing import Annotated, ClassVar

import typer

from undertow.cli.options.command import Command
from undertow.cli.options.shared import AllowCode, Details, Overwrite, Priors, ScenarioFile, results


@dataclasses.dataclass(frozen=True)
class IdentifyDesignCommand(Command):
    """Design the next experiment for `undertow identify`: forces that tell most of a vehicle's numbers, within a room.

    The deviations of the vehicle file, or usual ones, are what is known beforehand; noise is that of the scenario's
    navigation. The command writes experiment.yaml, a scenario whose controller keeps the place and adds the forces of
    experiment.csv, with limits that end it. `undertow simulate`, `run` and `mavlink` take it. experiment.html
    and experiment.json have the deviations to expect.
    """

    runs: ClassVar = "undertow.cli.identify_design:identify_design"
    named: ClassVar = "identify-design"
    scenario: ScenarioFile
    room: Annotated[
        tuple[float, float, float],
        typer.Option(metavar="L W H", help="Room around the station: along the heading, across, and vertical, m."),
    ] = (3.0, 3.0, 2.0)
    duration: Annotated[float, typer.Option(metavar="S", help="Length of the script.")] = 300.0
    of_interest: Annotated[
        list[str] | None,
        typer.Option(
            "--for",
            metavar="NAME",
            help="A parameter of interest, a group (added_mass) or a pattern (*.yaw); may be repeated. Default: all "
            "that are free.",
        ),
    ] = None
    free: Annotated[
        list[str] | None,
        typer.Option(metavar="NAME", help="As for `undertow identify`: what will be estimated; may be repeated."),
    ] = None
    prior: Priors = None
    depth: Annotated[
        float | None,
        typer.Option(metavar="M", help="Depth of the station. Default: that of the reference, or enough for the room."),
    ] = None
    max_rate: Annotated[float, typer.Option(metavar="RAD/S", help="Angular velocity that ends the script.")] = 2.0
    max_angle: Annotated[
        float, typer.Option(metavar="RAD", help="Roll, pitch, or departure from the heading that ends the script.")
    ] = 0.6
    max_input: Annotated[
        float | None,
        typer.Option(metavar="V", help="Input of a thruster that ends the script. Default: 90 % of its limit."),
    ] = None
    out: Annotated[Path | None, results("runs/NAME-experiment")] = None
    overwrite: Overwrite = False
    allow_code: AllowCode = False
    details: Details = False
