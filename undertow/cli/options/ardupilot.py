"""Options of `undertow ardupilot`."""

import dataclasses
from typing import Annotated, ClassVar

import typer

from undertow.cli.options.command import Command
from undertow.cli.options.shared import AllowCode, ScenarioFile


@dataclasses.dataclass(frozen=True)
class ArdupilotCommand(Command):
    """Be the physics behind ArduSub's software in the loop.

    The command speaks ArduPilot's JSON simulator interface: servo pulses come in, readings of the scenario's vehicle
    go out, in lock step. Disturbances are those of the scenario; its controller is not used. Start ArduSub with
    `--model JSON:127.0.0.1`.
    """

    runs: ClassVar = "undertow.cli.ardupilot:ardupilot"
    scenario: ScenarioFile
    address: Annotated[
        str, typer.Option(metavar="ADDRESS", help="Address of this machine to listen on; 0.0.0.0 for all.")
    ] = "127.0.0.1"
    port: Annotated[int, typer.Option(metavar="PORT", help="UDP port; SITL's option -I1 sends to 9012.")] = 9002
    frame: Annotated[
        str | None,
        typer.Option(
            metavar="NAME",
            help="Frame of ArduSub: vectored_6dof or vectored. Default: the one with as many motors as the vehicle.",
        ),
    ] = None
    channels: Annotated[
        str | None,
        typer.Option(
            metavar="LIST",
            help="Servo channel of each thruster, negative where it turns the other way: --channels=1,2,-3. Default: "
            "found from the frame and the geometry of the thrusters.",
        ),
    ] = None
    depth: Annotated[
        float | None,
        typer.Option(
            metavar="M",
            help="Depth of the scenario's origin below the surface, m. Default: that of the scenario's waves or "
            "surface; 0 without either.",
        ),
    ] = None
    duration: Annotated[
        float | None, typer.Option(metavar="S", help="End after this time of the physics, s. Default: at Ctrl-C.")
    ] = None
    allow_code: AllowCode = False
