"""Options of `undertow analyze`."""

import dataclasses
from pathlib import Path
from typing import Annotated, ClassVar

import typer

from undertow.cli.options.command import Command
from undertow.cli.options.shared import AllowCode, Details, Overwrite, Pdf, ScenarioFile, results


@dataclasses.dataclass(frozen=True)
class AnalyzeCommand(Command):
    """Predict closed-loop performance and stability margins without simulating.

    The command linearises the whole closed loop at its equilibrium and reports the poles over the operating range, the
    sampling limit, the delay and lag margins, the response to noise and disturbances, and the actuator authority. It
    writes prediction.html, prediction.json and figures/.
    """

    runs: ClassVar = "undertow.cli.analyze:analyze"
    scenario: ScenarioFile
    out: Annotated[Path | None, results("runs/NAME-prediction")] = None
    overwrite: Overwrite = False
    vehicles: Annotated[
        int,
        typer.Option(
            metavar="N",
            min=0,
            help="Also judge N vehicles at random within the deviations of the vehicle file, where it has any.",
        ),
    ] = 8
    allow_code: AllowCode = False
    pdf: Pdf = None
    details: Details = False
