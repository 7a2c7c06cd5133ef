"""Options of `undertow reproduce`."""

import dataclasses
from pathlib import Path
from typing import Annotated, ClassVar

import typer

from undertow.cli.options.command import Command
from undertow.cli.options.shared import Pdf


@dataclasses.dataclass(frozen=True)
class ReproduceCommand(Command):
    """Reproduce the paper.

    The command computes every figure and table of the paper, checks its claims, and writes two HTML pages,
    DIR/report.html and DIR/ablations.html.
    """

    runs: ClassVar = "undertow.cli.reproduce:reproduce"
    out: Annotated[
        Path,
        typer.Option(
            metavar="DIR", help="Folder for the report. It is created if missing; an earlier report is replaced."
        ),
    ] = Path("reproduction")
    quick: Annotated[
        bool, typer.Option("--quick", help="Skip the parameter sweeps. The other results stay the same.")
    ] = False
    pdf: Pdf = None
