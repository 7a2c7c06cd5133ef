"""Options of `undertow tune`."""

import dataclasses
from pathlib import Path
from typing import Annotated, ClassVar

import typer

from undertow.cli.options.command import Command
from undertow.cli.options.shared import AllowCode, Details, Overwrite, Pdf, Resume, ScenarioFile, results


@dataclasses.dataclass(frozen=True)
class TuneCommand(Command):
    """Tune the gains of a controller.

    The command simulates the closed loop with many candidate gains on a training set of seeds, disturbance sizes and
    published parameter sets, and evaluates the best on held-out runs, where the given gains are kept unless these are
    better. It accepts only gains with a certificate of stability. It writes tuned.yaml (a scenario with the gains),
    tuning.json and figures/. The section `tune` of the scenario has the options.
    """

    runs: ClassVar = "undertow.cli.tune:tune_scenario"
    named: ClassVar = "tune"
    scenario: ScenarioFile
    out: Annotated[Path | None, results("runs/NAME-tuned")] = None
    method: Annotated[
        str,
        typer.Option(
            metavar="METHOD",
            help="search (differential evolution); gradient (quasi-Newton); or evolution (mutation and selection "
            "around the best gains, for few evaluations).",
        ),
    ] = "search"
    budget: Annotated[
        float, typer.Option(metavar="SECONDS", help="Time budget of the whole command, compiling included.")
    ] = 240.0
    resume: Resume = False
    overwrite: Overwrite = False
    allow_code: AllowCode = False
    pdf: Pdf = None
    details: Details = False
