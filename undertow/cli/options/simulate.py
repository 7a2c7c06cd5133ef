"""Options of `undertow simulate`."""

import dataclasses
from pathlib import Path
from typing import Annotated, ClassVar

import typer

from undertow.cli.options.command import Command
from undertow.cli.options.shared import AllowCode, Details, Overwrite, Pdf, ScenarioFile


@dataclasses.dataclass(frozen=True)
class SimulateCommand(Command):
    """Simulate one scenario.

    The command says whether the run went well, and by what, and writes run.nc, metrics.json, scenario.yaml, run.mcap,
    figures/ and run.html when the run has ended.
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
    details: Details = False
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
