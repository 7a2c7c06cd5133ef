"""Options of `undertow falsify`."""

import dataclasses
from pathlib import Path
from typing import Annotated, ClassVar

import typer

from undertow.cli.options.command import Command
from undertow.cli.options.shared import AllowCode, Details, Overwrite, Pdf, Resume, ScenarioFile, results


@dataclasses.dataclass(frozen=True)
class FalsifyCommand(Command):
    """Find the smallest departure from a scenario, within bounds, that breaks a requirement.

    The section `falsify` of the scenario gives the bounds of what varies, and `requirements` what every run must keep.
    The command first breaks a requirement, then shrinks the departure that broke it. It writes falsify.json, figures/
    and counterexample.yaml, a scenario with which `undertow simulate` repeats the failure.
    """

    runs: ClassVar = "undertow.cli.falsify:falsify_scenario"
    named: ClassVar = "falsify"
    scenario: ScenarioFile
    out: Annotated[Path | None, results("runs/NAME-falsified")] = None
    method: Annotated[
        str,
        typer.Option(
            metavar="METHOD",
            help="gradient (by differentiation where possible, and search), or search (without differentiation).",
        ),
    ] = "gradient"
    budget: Annotated[int, typer.Option(metavar="RUNS", help="Largest number of runs.")] = 2000
    seed: Annotated[int, typer.Option(metavar="N", help="Seed of the search, not of the runs.")] = 0
    resume: Resume = False
    overwrite: Overwrite = False
    allow_code: AllowCode = False
    pdf: Pdf = None
    details: Details = False
