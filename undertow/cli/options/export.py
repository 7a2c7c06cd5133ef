"""Options of `undertow export`."""

import dataclasses
from pathlib import Path
from typing import Annotated, ClassVar

import typer

from undertow.cli.options.command import Command
from undertow.cli.options.shared import AllowCode, ScenarioFile


@dataclasses.dataclass(frozen=True)
class ExportCommand(Command):
    """Export the controller, the navigation filter and the vehicle of a scenario, to run them outside Python.

    The C code needs no heap and no library but libm, and in double precision it has the bits of a simulation: `make
    test` in the folder compares them. The FMUs hold this code, and a library for Linux where there is a C compiler. The
    page holds the whole loop, compiled by the package ziglang, and opens from disk.
    """

    runs: ClassVar = "undertow.cli.export:export"
    scenario: ScenarioFile
    c99: Annotated[
        Path | None, typer.Option("--c99", metavar="DIR", help="Write a part of the scenario as C99 into this folder.")
    ] = None
    part: Annotated[
        str,
        typer.Option(
            metavar="WORD", help="Part for --c99: controller, navigation (its filter), or vehicle (with disturbances)."
        ),
    ] = "controller"
    fmu: Annotated[
        Path | None,
        typer.Option(
            "--fmu",
            metavar="DIR",
            help="Write controller.fmu and vehicle.fmu, FMI 2.0 co-simulation, into this folder.",
        ),
    ] = None
    wasm: Annotated[
        Path | None,
        typer.Option(
            "--wasm",
            metavar="DIR",
            help="Write index.html into this folder: a page in which a visitor drives the vehicle, by WebAssembly.",
        ),
    ] = None
    controllers: Annotated[
        str | None,
        typer.Option(
            metavar="NAMES",
            help="Controllers among which the page of --wasm lets a visitor choose, separated by commas, as of "
            "`undertow compare`. Default: that of the scenario.",
        ),
    ] = None
    name: Annotated[
        str | None,
        typer.Option(
            metavar="NAME", help="Begins the names of files and functions in C. Default: the name of the part."
        ),
    ] = None
    precision: Annotated[
        str | None, typer.Option(metavar="WORD", help="float64 or float32. Default: that of the scenario.")
    ] = None
    attitude: Annotated[str, typer.Option(metavar="WORD", help="Measured attitude: euler or quaternion.")] = "euler"
    velocity: Annotated[str, typer.Option(metavar="WORD", help="Measured velocity: body, world or rates.")] = "body"
    output: Annotated[
        str,
        typer.Option(metavar="WORD", help="What the vehicle takes: input (usually volts), newtons, pulses, wrench."),
    ] = "input"
    overwrite: Annotated[bool, typer.Option("--overwrite", help="Replace the files of an earlier export.")] = False
    allow_code: AllowCode = False
