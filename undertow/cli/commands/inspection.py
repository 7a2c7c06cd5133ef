"""Commands that show what there is: parts, files, logs, speed, and undertow itself."""

import dataclasses
from pathlib import Path
from typing import Annotated, ClassVar

import typer

from undertow.cli.commands.command import Command
from undertow.cli.commands.options import AllowCode


@dataclasses.dataclass(frozen=True)
class ListCommand(Command):
    """List the available parts.

    Kinds: vehicles, thrusters, power, plants, controllers, disturbances, references, sensors, navigation, faults.
    `undertow list faults` shows every pair of target and mode, with the meaning of its severity.
    """

    runs: ClassVar = "undertow.cli.describe:list_parts"
    named: ClassVar = "list"
    kind: Annotated[str | None, typer.Argument(metavar="[KIND]", help="One kind only, e.g. thrusters.")] = None
    as_json: Annotated[
        bool, typer.Option("--json", help="Print JSON instead of a table: with faults every target and mode.")
    ] = False


@dataclasses.dataclass(frozen=True)
class DescribeCommand(Command):
    """Describe a part.

    The command shows the options of the part, its parameters with unit, symbol and source, and advice. `describe
    scenario` shows the keys of a scenario file, `describe campaign` those of a campaign file, `describe metrics` the
    metrics with their units.
    """

    runs: ClassVar = "undertow.cli.describe:describe"
    name: Annotated[
        str,
        typer.Argument(
            metavar="NAME",
            help="A part (see `undertow list`), ./file.py:function, a vehicle file, or one of the words scenario, "
            "campaign, metrics and signals.",
        ),
    ]
    json_schema: Annotated[
        bool,
        typer.Option("--json-schema", help="With NAME scenario or campaign: print the JSON schema that editors use."),
    ] = False


@dataclasses.dataclass(frozen=True)
class CheckCommand(Command):
    """Check a vehicle, another part, a scenario or a campaign.

    The command reports errors and advice, each with the numbers that caused it, and quantities derived from the
    parameters. The exit code is 2 if there are errors.
    """

    runs: ClassVar = "undertow.cli.check:check"
    thing: Annotated[
        str,
        typer.Argument(
            metavar="THING", help="A vehicle file, a scenario, a campaign, a part by name, or ./file.py:function."
        ),
    ]
    option: Annotated[
        list[str] | None,
        typer.Option(
            "--option", metavar="KEY=VALUE", help="Option of the part, for example parameters=wu2018. Repeatable."
        ),
    ] = None
    allow_code: AllowCode = False


@dataclasses.dataclass(frozen=True)
class LogsCommand(Command):
    """Show what is in a log, and convert it.

    The command reads MCAP, CSV, run.nc, bags of ROS 2, .bin files of ArduPilot and .ulg files of PX4, and shows the
    signals with unit, rate and gaps. `undertow logs score SCENARIO FILE` starts the model of the vehicle every 5 s from
    the logged motion, drives it with the logged commands, and reports how far it is from the log after 1, 5 and 10 s.
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


@dataclasses.dataclass(frozen=True)
class BenchCommand(Command):
    """Measure the speed of undertow on this machine, compared with plain NumPy.

    The workloads are W1 (ODIN with eight full motor models under the paper's controller, 1 kHz) and W2 (BlueROV2 Heavy
    in current and waves, 100 Hz). The command takes some minutes, most of them for compiling. With `--users` it
    measures how many seconds `simulate` and `compare` take to print their results and to write their files.
    """

    runs: ClassVar = "undertow.cli.bench:bench"
    as_json: Annotated[bool, typer.Option("--json", help="Print JSON instead of tables.")] = False
    users: Annotated[
        bool, typer.Option("--users", help="Measure how long commands take, with empty caches and after a change.")
    ] = False


@dataclasses.dataclass(frozen=True)
class VersionCommand(Command):
    """Show the versions of undertow, its dependencies and Python."""

    runs: ClassVar = "undertow.cli.version:version"


COMMANDS = (ListCommand, DescribeCommand, CheckCommand, LogsCommand, BenchCommand, VersionCommand)
