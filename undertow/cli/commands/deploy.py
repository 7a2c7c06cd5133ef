"""Commands that bring a controller to a vehicle, or a vehicle to other people's software."""

import dataclasses
from pathlib import Path
from typing import Annotated, ClassVar

import typer

from undertow.cli.commands.command import Command
from undertow.cli.commands.options import AllowCode, Overwrite, ScenarioFile, StepLog, Unsupervised


@dataclasses.dataclass(frozen=True)
class ExportCommand(Command):
    """Export the controller, the navigation filter and the vehicle of a scenario, to run them outside Python.

    The C code needs no heap and no library but libm, and in double precision it has the bits of a simulation: `make
    test` in the folder compares them. The FMUs hold this code, and a library for Linux where there is a C compiler.
    """

    runs: ClassVar = "undertow.cli.export:export"
    scenario: ScenarioFile
    c99: Annotated[
        Path | None, typer.Option("--c99", metavar="DIR", help="Write a part of the scenario as C99 into this folder.")
    ] = None
    part: Annotated[
        str,
        typer.Option(
            metavar="WORD", help="Part for --c99: controller, navigation (its filter), or vehicle (with disturbances)."
        ),
    ] = "controller"
    fmu: Annotated[
        Path | None,
        typer.Option(
            "--fmu",
            metavar="DIR",
            help="Write controller.fmu and vehicle.fmu, FMI 2.0 co-simulation, into this folder.",
        ),
    ] = None
    name: Annotated[
        str | None,
        typer.Option(
            metavar="NAME", help="Begins the names of files and functions in C. Default: the name of the part."
        ),
    ] = None
    precision: Annotated[
        str | None, typer.Option(metavar="WORD", help="float64 or float32. Default: that of the scenario.")
    ] = None
    attitude: Annotated[str, typer.Option(metavar="WORD", help="Measured attitude: euler or quaternion.")] = "euler"
    velocity: Annotated[str, typer.Option(metavar="WORD", help="Measured velocity: body, world or rates.")] = "body"
    output: Annotated[
        str,
        typer.Option(metavar="WORD", help="What the vehicle takes: input (usually volts), newtons, pulses, wrench."),
    ] = "input"
    overwrite: Annotated[bool, typer.Option("--overwrite", help="Replace the files of an earlier export.")] = False
    allow_code: AllowCode = False


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


COMMANDS = (ExportCommand, RunCommand, Ros2Command, MavlinkCommand, ArdupilotCommand)
