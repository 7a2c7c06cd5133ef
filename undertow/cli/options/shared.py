"""Options that several commands have, as typer declares them."""

from pathlib import Path
from typing import Annotated, Any

import typer

ScenarioFile = Annotated[Path, typer.Argument(metavar="SCENARIO", help="A .yaml file, or an earlier run.nc.")]

AllowCode = Annotated[
    bool,
    typer.Option(
        "--allow-code", help="Run the Python code that a result file names. Code that a .yaml file names always runs."
    ),
]

Unsupervised = Annotated[
    bool,
    typer.Option(
        "--unsupervised",
        help="No supervisor, unless the scenario has one: one wrong message can then end control at full thrust.",
    ),
]

Pdf = Annotated[
    str | None,
    typer.Option(
        "--pdf",
        metavar="WIDTH",
        help="Also write every figure as PDF: wide (as on the page), or one-column (3.5 in, without its title).",
    ),
]

Priors = Annotated[
    list[str] | None,
    typer.Option(
        "--prior",
        metavar="NAME=VALUE+-DEVIATION",
        help="What is known of a parameter beforehand, as mass=11.5+-0.2 or mass=11.5+-2%; may be repeated.",
    ),
]

Replay = Annotated[
    bool,
    typer.Option(
        "--replay",
        help="Run some trials again and show them on the page in three dimensions: `compare` the first trial of up to "
        "four controllers or scenarios, `campaign` the three worst trials. Compiling takes up to a minute for each "
        "controller. With --resume, add the replay to existing results.",
    ),
]

Details = Annotated[bool, typer.Option("--details", help="Also print the tables, which files and page hold as well.")]

Overwrite = Annotated[bool, typer.Option("--overwrite", help="Replace an earlier result in DIR.")]

Resume = Annotated[
    bool, typer.Option("--resume", help="Continue what was interrupted in DIR, or add trials; what is done is kept.")
]

StepLog = Annotated[
    Path | None,
    typer.Option(
        "--log", metavar="FILE.mcap", help="Log every step to this file; `undertow run --link log:FILE` replays it."
    ),
]

Workers = Annotated[int | None, typer.Option(metavar="N", help="Number of threads. Default: all cores.")]


def results(default: str) -> Any:
    """The option `--out` of a command whose results are in a folder; `default` says which one without it."""
    return typer.Option(metavar="DIR", help=f"Folder for the results. Default: {default}, or the next free one.")
