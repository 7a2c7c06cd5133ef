"""Options of `undertow logs`."""

import dataclasses
from pathlib import Path
from typing import Annotated, ClassVar

import typer

from undertow.cli.options.command import Command
from undertow.cli.options.shared import AllowCode


@dataclasses.dataclass(frozen=True)
class LogsCommand(Command):
    """Show what is in a log, and convert it.

    The command reads MCAP, CSV, run.nc, bags of ROS 1 and 2, .bin files of ArduPilot, .tlog files of MAVLink and .ulg
    files of PX4, and shows the signals with unit, rate and gaps. `undertow logs score SCENARIO FILE` starts the model
    of the vehicle every 5 s from the logged motion, drives it with the logged commands, and reports how far it is from
    the log after 1, 5 and 10 s.
    """

    runs: ClassVar = "undertow.cli.logs:logs"
    subcommands: ClassVar = {"layout": "undertow.cli.logs:layout", "score": "undertow.cli.log_score:score_log"}
    words: Annotated[
        list[str],
        typer.Argument(
            metavar="FILE", help="A log; or `score SCENARIO FILE`; or the word `layout`, which writes one for Foxglove."
        ),
    ]
    mapping: Annotated[
        Path | None,
        typer.Option(metavar="FILE.yaml", help="Which columns of the log are which signal, in which unit and frame."),
    ] = None
    out: Annotated[
        Path | None,
        typer.Option(
            metavar="PATH",
            help="Write the log to this .mcap or .csv file. For `score`, the folder for the results (default: "
            "runs/NAME-score); for `layout`, the .json file.",
        ),
    ] = None
    overwrite: Annotated[bool, typer.Option("--overwrite", help="Replace an earlier file or result.")] = False
    allow_code: AllowCode = False

    def target(self) -> str:
        """What the first word chooses, unless it is a file."""
        word = self.words[0]
        return self.runs if Path(word).exists() else self.subcommands.get(word, self.runs)
