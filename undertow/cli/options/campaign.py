"""Options of `undertow campaign`."""

import dataclasses
from pathlib import Path
from typing import Annotated, ClassVar

import typer

from undertow.cli.options.command import Command
from undertow.cli.options.shared import AllowCode, Details, Overwrite, Pdf, Replay, Resume, Workers, results


@dataclasses.dataclass(frozen=True)
class CampaignCommand(Command):
    """Run a Monte Carlo study or a parameter sweep of one scenario.

    The command writes trials.zarr, campaign.html, summary.json, figures/ and the scenarios of the worst trials. After
    Ctrl-C, kill -9 or a full disk, --resume continues without loss. `undertow campaign status DIR` prints the progress.
    """

    runs: ClassVar = "undertow.cli.campaign:campaign"
    campaign: Annotated[Path, typer.Argument(metavar="CAMPAIGN", help="A .yaml file, or the word `status`.")]
    folder: Annotated[
        Path | None, typer.Argument(metavar="[DIR]", help="After `status`: the folder of a campaign.")
    ] = None
    out: Annotated[Path | None, results("runs/NAME")] = None
    resume: Resume = False
    workers: Workers = None
    cluster: Annotated[
        str | None,
        typer.Option(metavar="WHERE", help="Dask cluster: local, slurm, ssh, or the address of a scheduler."),
    ] = None
    overwrite: Overwrite = False
    allow_code: AllowCode = False
    pdf: Pdf = None
    replay: Replay = False
    details: Details = False
