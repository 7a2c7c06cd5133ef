"""`undertow ardupilot`: the vehicle of a scenario as the physics behind ArduSub."""

import numpy as np
import typer

from undertow.cli.exit_codes import DONE, RUN_FAILED, complain
from undertow.cli.options.ardupilot import ArdupilotCommand
from undertow.cli.stages import stage
from undertow.cli.tables import wide_console
from undertow.core import checks
from undertow.outside.ardupilot.server import listen, serve
from undertow.outside.ardupilot.session import Session
from undertow.outside.stepped_vehicle import SteppedVehicle
from undertow.outside.thruster_channels import channels_of_vehicle


def ardupilot(command: ArdupilotCommand) -> int:
    """Answer ArduPilot's packets until Ctrl-C; return the exit code."""
    console = wide_console()
    depth = command.depth
    duration = command.duration
    if depth is not None:
        checks.finite("depth", depth, "m")
    if duration is not None:
        checks.positive("duration", duration, "s")
    with stage(console, "building and compiling"):
        vehicle = SteppedVehicle(command.scenario, command.allow_code, depth, otherwise=0.0)
    driven = channels_of_vehicle(np.asarray(vehicle.plant.thruster_matrix), command.frame, command.channels)
    session = Session(vehicle, driven)
    with listen(command.address, command.port) as link:
        typer.echo(f"Listening on UDP {command.address}:{link.getsockname()[1]}. Channels of the thrusters: {driven}")
        serve(session, link, typer.echo, float("inf") if duration is None else duration)
    if session.ended:
        complain(f"the vehicle ended as `{vehicle.status.word}` at {vehicle.time:.4g} s. {vehicle.status.sentence}")
        return RUN_FAILED
    return DONE
