"""Options of `undertow arena`."""

import dataclasses
from pathlib import Path
from typing import Annotated, ClassVar

import typer

from undertow.cli.options.command import Command
from undertow.cli.options.shared import Details, Pdf, Workers


@dataclasses.dataclass(frozen=True)
class ArenaCommand(Command):
    """Run control laws through fixed tasks on four vehicles, and write the leader board.

    The fifteen tasks reach from station keeping in waves to the models of other publications. Results of other laws
    in DIR stay, trials that are there are not repeated, and the same command continues after an interruption. A law of
    your own enters by `undertow arena ./mine.py:law`. The command writes leaderboard.html, .json, .csv and .md,
    figures/ and laws/, which has the scenario of every task.
    """

    runs: ClassVar = "undertow.cli.arena:arena"
    controllers: Annotated[
        list[str] | None,
        typer.Argument(
            metavar="[CONTROLLER...]",
            help="Laws that enter: presets (robust), controllers (pid), ./file.py:function, scenario files whose "
            "controller is taken (tuned.yaml); NAME=ENTRY gives a name. Default: all of undertow but nmpc.",
        ),
    ] = None
    out: Annotated[
        Path | None, typer.Option(metavar="DIR", help="Folder of the results of all laws. Default: runs/arena.")
    ] = None
    trials: Annotated[int, typer.Option(metavar="N", help="Trials of every task on every vehicle.")] = 8
    tasks: Annotated[str | None, typer.Option(metavar="LIST", help="Some of the tasks only.")] = None
    vehicles: Annotated[str | None, typer.Option(metavar="LIST", help="Some of the vehicles only.")] = None
    tune: Annotated[
        int | None,
        typer.Option(
            metavar="EVALUATIONS",
            help="Tune the gains of every law for every vehicle first, with this number of evaluations, at least 12, "
            "on a motion, a sea and parameter sets that no task has.",
        ),
    ] = None
    robustness: Annotated[
        bool, typer.Option("--robustness", help="Also compute the error over ten parameters until a law fails.")
    ] = False
    workers: Workers = None
    overwrite: Annotated[bool, typer.Option("--overwrite", help="Replace the results of the named laws in DIR.")] = (
        False
    )
    pdf: Pdf = None
    details: Details = False
