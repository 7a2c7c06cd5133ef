"""Options of `python -m soak`."""

import dataclasses
from pathlib import Path
from typing import Annotated, ClassVar

import typer

from undertow.cli.options.command import Command
from undertow.cli.options.shared import Overwrite, results


@dataclasses.dataclass(frozen=True)
class SoakCommand(Command):
    """Attack undertow itself, and count what must never happen.

    The command tries thousands of hostile files and command lines, kills campaigns and resumes them, simulates hours in
    waves and noise, injects random faults, checks that an unprotected law fails where it must, and attacks the commands
    that control a vehicle. It writes soak.json, soak.html, and the files of each failed input. The exit code is 1 if
    there was a never-event.
    """

    runs: ClassVar = "soak.command:soak"
    parts: Annotated[
        list[str] | None,
        typer.Argument(metavar="[PART]...", help="inputs, kills, hours, faults, controls, links. Default: all."),
    ] = None
    inputs: Annotated[int | None, typer.Option(metavar="N", help="Hostile inputs. Default: 2000.")] = None
    kills: Annotated[int | None, typer.Option(metavar="N", help="Ended processes. Default: 5.")] = None
    hours: Annotated[float | None, typer.Option(metavar="H", help="Simulated vehicle-hours. Default: 4.")] = None
    faults: Annotated[int | None, typer.Option(metavar="N", help="Runs with random faults. Default: 500.")] = None
    links: Annotated[int | None, typer.Option(metavar="N", help="Runs of each link command. Default: 20.")] = None
    minutes: Annotated[
        float | None, typer.Option(metavar="M", help="Begin nothing further after this time. Default: no limit.")
    ] = None
    seed: Annotated[int | None, typer.Option(metavar="N", help="Default: from the clock; it is printed.")] = None
    short: Annotated[bool, typer.Option("--short", help="A little of each, in three minutes.")] = False
    replay: Annotated[
        str | None,
        typer.Option(metavar="WHAT", help="Repeat failures alone: a file soak.json, or an identity from one."),
    ] = None
    out: Annotated[Path | None, results("runs/soak")] = None
    overwrite: Overwrite = False
