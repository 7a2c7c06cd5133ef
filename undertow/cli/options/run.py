"""Options of `undertow run`."""

import dataclasses
from pathlib import Path
from typing import Annotated, ClassVar

import typer

from undertow.cli.options.command import Command
from undertow.cli.options.shared import AllowCode, Overwrite, ScenarioFile, Unsupervised


@dataclasses.dataclass(frozen=True)
class RunCommand(Command):
    """Run the controller of a scenario in real time, with a link to its vehicle.

    One command per sampling time, a log of every step, and statistics of jitter, computing time and overruns. However
    the run ends, the last thing sent is the safe output. Before you use it on a vehicle, read docs/how-to/real-time.md.
    """

    runs: ClassVar = "undertow.cli.run:run"
    scenario: ScenarioFile
    link: Annotated[
        str,
        typer.Option(
            metavar="LINK",
            help="vehicle (that of the scenario, in this process), udp:HOST:PORT (a vehicle there), or log:FILE "
            "(replay the run.mcap of an earlier run and compare the commands).",
        ),
    ] = "vehicle"
    serve: Annotated[
        str | None,
        typer.Option(metavar="HOST:PORT", help="Be the simulated vehicle of a link by UDP, and listen there."),
    ] = None
    fast: Annotated[
        bool, typer.Option("--fast", help="Do not wait: a simulated clock, and the bits of `simulate`.")
    ] = False
    duration: Annotated[
        float | None,
        typer.Option(metavar="S", help="Default: that of the scenario; with udp, until Ctrl-C. inf: no end."),
    ] = None
    safe: Annotated[
        str,
        typer.Option(
            metavar="NUMBERS",
            help="Output sent last, in the unit of the input: one number, or one per actuator (1,0,...).",
        ),
    ] = "0"
    deadline: Annotated[
        float | None,
        typer.Option(metavar="S", help="Time from the start of a period to its command. Default: the sampling time."),
    ] = None
    max_age: Annotated[
        float, typer.Option(metavar="S", help="Without a measurement for so long, the run ends with the safe output.")
    ] = 0.5
    patience: Annotated[float, typer.Option(metavar="S", help="Longest wait for the first measurement.")] = 10.0
    priority: Annotated[
        int | None, typer.Option(metavar="1-99", help="Real-time priority of the loop (SCHED_FIFO); needs permission.")
    ] = None
    cpu: Annotated[int | None, typer.Option(metavar="N", help="Processor on which the loop stays.")] = None
    out: Annotated[
        Path | None, typer.Option(metavar="DIR", help="Folder for run.mcap and statistics.json. Default: runs/NAME.")
    ] = None
    overwrite: Overwrite = False
    as_json: Annotated[bool, typer.Option("--json", help="Print the statistics as JSON.")] = False
    unsupervised: Unsupervised = False
    allow_code: AllowCode = False
