"""Options of `undertow bench`."""

import dataclasses
from typing import Annotated, ClassVar

import typer

from undertow.cli.options.command import Command


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
