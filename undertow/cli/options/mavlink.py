"""Options of `undertow mavlink`."""

import dataclasses
from pathlib import Path
from typing import Annotated, ClassVar

import typer

from undertow.cli.options.command import Command
from undertow.cli.options.shared import AllowCode, ScenarioFile, StepLog, Unsupervised


@dataclasses.dataclass(frozen=True)
class MavlinkCommand(Command):
    """Control a vehicle over MAVLink, as a companion of its autopilot.

    Odometry comes in, the controller of the scenario runs, commands for the thrusters go out. It runs only while the
    vehicle is armed, which this command never does, and sends neutral commands when it stops. Before you use it on a
    vehicle, read docs/how-to/mavlink.md.
    """

    runs: ClassVar = "undertow.cli.mavlink:mavlink"
    needs: ClassVar = ("pymavlink",)
    scenario: ScenarioFile
    connect: Annotated[
        str,
        typer.Option(metavar="PLACE", help="udpin:HOST:PORT (or udp:...) to listen, udpout:HOST:PORT to send first."),
    ]
    output: Annotated[
        str,
        typer.Option(metavar="WORD", help="Commands for the thrusters: rc_override, servo, actuator, control_target."),
    ] = "rc_override"
    source: Annotated[
        str, typer.Option("--input", metavar="WORD", help="Measured motion: odometry, or local_position with attitude.")
    ] = "odometry"
    system: Annotated[
        int, typer.Option(metavar="ID", help="Our system id. ArduPilot takes RC overrides from MAV_GCS_SYSID only.")
    ] = 255
    target_system: Annotated[int, typer.Option(metavar="ID", help="System id of the vehicle.")] = 1
    target_component: Annotated[int, typer.Option(metavar="ID", help="Component id of its autopilot.")] = 1
    signing_key: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE",
            help="Sign messages, and refuse those of others: 32 bytes, or a passphrase as of a ground station.",
        ),
    ] = None
    relative: Annotated[
        bool, typer.Option("--relative", help="North and east of the reference count from where control begins.")
    ] = False
    frame: Annotated[
        str | None, typer.Option(metavar="NAME", help="Frame of ArduSub: vectored_6dof or vectored; see `ardupilot`.")
    ] = None
    channels: Annotated[
        str | None, typer.Option(metavar="LIST", help="Channel of each thruster: --channels=1,2,-3; see `ardupilot`.")
    ] = None
    timeout: Annotated[
        float, typer.Option(metavar="S", help="Time without valid odometry after which the thrusters stop, s.")
    ] = 0.5
    duration: Annotated[float | None, typer.Option(metavar="S", help="End after this time, s. Default: at Ctrl-C.")] = (
        None
    )
    log: StepLog = None
    unsupervised: Unsupervised = False
    allow_code: AllowCode = False
