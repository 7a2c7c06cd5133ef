"""Options of `undertow ros2`."""

import dataclasses
from pathlib import Path
from typing import Annotated, ClassVar

import typer

from undertow.cli.options.command import Command
from undertow.cli.options.shared import AllowCode, ScenarioFile, StepLog, Unsupervised


@dataclasses.dataclass(frozen=True)
class Ros2Command(Command):
    """Run the controller of a scenario, or its simulated vehicle, as a ROS 2 node. No ROS installation is needed.

    The controller takes odometry and publishes thruster commands or a wrench; the vehicle takes thruster commands and
    publishes odometry, IMU readings and /clock. World axes are east, north, up and body axes forward, port, up, as REP
    103 says. On Ctrl-C the controller commands zero thrust.
    """

    runs: ClassVar = "undertow.cli.ros2:ros2"
    needs: ClassVar = ("cyclonedds", "rosbags")
    scenario: ScenarioFile
    role: Annotated[str, typer.Option("--as", metavar="ROLE", help="controller, or vehicle (simulated).")] = (
        "controller"
    )
    output: Annotated[
        str | None,
        typer.Option(
            metavar="WORD",
            help="Commands of the controller: input (default; usually volts), newtons or pulses (an array, one number "
            "per thruster), or wrench.",
        ),
    ] = None
    pace: Annotated[
        str | None,
        typer.Option(
            metavar="WORD",
            help="Of the vehicle: real-time (default), lock-step (each step waits for its command), or fast.",
        ),
    ] = None
    use_sim_time: Annotated[bool, typer.Option("--use-sim-time", help="The controller takes its time from /clock.")] = (
        False
    )
    remap: Annotated[
        list[str] | None,
        typer.Option(
            metavar="RULE",
            help="Other name of a topic, as odom:=/vehicle/odometry. Topics: odom, target_pose, thrusters, wrench, "
            "imu, clock. Repeatable.",
        ),
    ] = None
    rate: Annotated[
        float | None, typer.Option(metavar="HZ", help="Control steps per second. Default: those of the scenario.")
    ] = None
    duration: Annotated[
        float | None,
        typer.Option(
            metavar="SECONDS", help="Default: that of the scenario for the vehicle, none for the controller. inf: none."
        ),
    ] = None
    max_age: Annotated[
        float,
        typer.Option(metavar="SECONDS", help="Without a message for so long, zero thrust is commanded or applied."),
    ] = 0.5
    domain: Annotated[int | None, typer.Option(metavar="N", help="Default: ROS_DOMAIN_ID, or 0.")] = None
    localhost: Annotated[
        bool,
        typer.Option("--localhost", help="Reach this machine only, without multicast. Also: ROS_LOCALHOST_ONLY=1."),
    ] = False
    reliability: Annotated[str, typer.Option(metavar="WORD", help="Quality of service: reliable, or best-effort.")] = (
        "reliable"
    )
    world_frame: Annotated[
        list[str] | None,
        typer.Option(metavar="NAME", help="Frame of poses, axes east, north, up. Default: odom and map. Repeatable."),
    ] = None
    body_frame: Annotated[str, typer.Option(metavar="NAME", help="Frame of the vehicle, axes forward, port, up.")] = (
        "base_link"
    )
    bag: Annotated[
        Path | None, typer.Option(metavar="DIR", help="Record all messages that the node sends and receives.")
    ] = None
    storage: Annotated[str, typer.Option(metavar="WORD", help="Of the bag: mcap or sqlite3.")] = "mcap"
    log: StepLog = None
    unsupervised: Unsupervised = False
    allow_code: AllowCode = False
