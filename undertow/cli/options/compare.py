"""Options of `undertow compare`."""

import dataclasses
from pathlib import Path
from typing import Annotated, ClassVar

import typer

from undertow.cli.options.command import Command
from undertow.cli.options.shared import AllowCode, Details, Overwrite, Pdf, Replay, Resume, Workers, results


@dataclasses.dataclass(frozen=True)
class CompareCommand(Command):
    """Compare controllers on one scenario, or several scenarios, on the same seeds.

    The command runs all of them on the same samples and seeds. It reports the medians, the paired differences with
    confidence intervals and a rank test, the Pareto fronts of error against effort, the computing time of a step, and
    the failures. It writes comparison.html, .json, .csv, .tex and .md, step_times.json, figures/, trials.zarr, and
    scenarios/ with the scenario of each controller.
    """

    runs: ClassVar = "undertow.cli.compare:compare"
    scenarios: Annotated[
        list[Path], typer.Argument(metavar="SCENARIO...", help="A .yaml file, several of them, or one campaign file.")
    ]
    controllers: Annotated[
        str | None,
        typer.Option(
            metavar="LIST",
            help="What to compare on one scenario, separated by commas: presets (robust, paper), controllers (pid), "
            "./file.py:function, scenario files whose controller is taken (tuned.yaml), and the word `scenario` for "
            "the scenario's own controller. NAME=ENTRY gives a name.",
        ),
    ] = None
    trials: Annotated[
        int | None, typer.Option(metavar="N", help="Trials of each. Default: 20, or the number of the campaign file.")
    ] = None
    out: Annotated[Path | None, results("runs/NAME-comparison")] = None
    resume: Resume = False
    workers: Workers = None
    overwrite: Overwrite = False
    allow_code: AllowCode = False
    pdf: Pdf = None
    replay: Replay = False
    tune: Annotated[
        int | None,
        typer.Option(
            metavar="EVALUATIONS",
            help="Tune the gains of every controller first, with this number of evaluations for each, at least 12. The "
            "trials then have held-out seeds, parameter sets and wave heights.",
        ),
    ] = None
    details: Details = False
