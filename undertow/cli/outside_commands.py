"""Declarations of the commands with which a scenario's parts leave undertow: exports, links to other programs, logs."""

from pathlib import Path
from typing import Annotated

import typer

from undertow.cli.options import AllowCode, ScenarioFile, Unsupervised


def export(
    scenario: ScenarioFile,
    c99: Annotated[
        Path | None, typer.Option("--c99", metavar="DIR", help="Write a part of the scenario as C99 into this folder.")
    ] = None,
    part: Annotated[
        str,
        typer.Option(
            metavar="WORD", help="Part for --c99: controller, navigation (its filter), or vehicle (with disturbances)."
        ),
    ] = "controller",
    fmu: Annotated[
        Path | None,
        typer.Option(
            "--fmu",
            metavar="DIR",
            help="Write controller.fmu and vehicle.fmu, FMI 2.0 co-simulation, into this folder.",
        ),
    ] = None,
    name: Annotated[
        str | None,
        typer.Option(
            metavar="NAME", help="Begins the names of files and functions in C. Default: the name of the part."
        ),
    ] = None,
    precision: Annotated[
        str | None, typer.Option(metavar="WORD", help="float64 or float32. Default: that of the scenario.")
    ] = None,
    attitude: Annotated[str, typer.Option(metavar="WORD", help="Measured attitude: euler or quaternion.")] = "euler",
    velocity: Annotated[str, typer.Option(metavar="WORD", help="Measured velocity: body, world or rates.")] = "body",
    output: Annotated[
        str,
        typer.Option(metavar="WORD", help="What the vehicle takes: input (usually volts), newtons, pulses, wrench."),
    ] = "input",
    overwrite: Annotated[bool, typer.Option("--overwrite", help="Replace the files of an earlier export.")] = False,
    allow_code: AllowCode = False,
) -> int:
    """Export the controller, the navigation filter and the vehicle of a scenario, to run them outside Python.

    The C code needs no heap and no library but libm, and in double precision it has the bits of a simulation: `make
    test` in the folder compares them. The FMUs hold this code, and a library for Linux where there is a C compiler.
    """
    from undertow.cli.export import export

    formats = {"precision": precision, "attitude": attitude, "velocity": velocity}
    return export(scenario, c99, fmu, part, name, output, overwrite, allow_code, formats)


def ardupilot(
    scenario: ScenarioFile,
    address: Annotated[
        str, typer.Option(metavar="ADDRESS", help="Address of this machine to listen on; 0.0.0.0 for all.")
    ] = "127.0.0.1",
    port: Annotated[int, typer.Option(metavar="PORT", help="UDP port; SITL's option -I1 sends to 9012.")] = 9002,
    frame: Annotated[
        str | None,
        typer.Option(
            metavar="NAME",
            help="Frame of ArduSub: vectored_6dof or vectored. Default: the one with as many motors as the vehicle.",
        ),
    ] = None,
    channels: Annotated[
        str | None,
        typer.Option(
            metavar="LIST",
            help="Servo channel of each thruster, negative where it turns the other way: --channels=1,2,-3. Default: "
            "found from the frame and the geometry of the thrusters.",
        ),
    ] = None,
    depth: Annotated[
        float | None,
        typer.Option(
            metavar="M",
            help="Depth of the scenario's origin below the surface, m. Default: that of the scenario's waves or "
            "surface; 0 without either.",
        ),
    ] = None,
    duration: Annotated[
        float | None, typer.Option(metavar="S", help="End after this time of the physics, s. Default: at Ctrl-C.")
    ] = None,
    allow_code: AllowCode = False,
) -> int:
    """Be the physics behind ArduSub's software in the loop.

    The command speaks ArduPilot's JSON simulator interface: servo pulses come in, readings of the scenario's vehicle
    go out, in lock step. Disturbances are those of the scenario; its controller is not used. Start ArduSub with
    `--model JSON:127.0.0.1`.
    """
    from undertow.cli.ardupilot import ardupilot

    return ardupilot(scenario, address, port, frame, channels, depth, duration, allow_code)


def mavlink(
    scenario: ScenarioFile,
    connect: Annotated[
        str,
        typer.Option(metavar="PLACE", help="udpin:HOST:PORT (or udp:...) to listen, udpout:HOST:PORT to send first."),
    ],
    output: Annotated[
        str,
        typer.Option(metavar="WORD", help="Commands for the thrusters: rc_override, servo, actuator, control_target."),
    ] = "rc_override",
    source: Annotated[
        str, typer.Option("--input", metavar="WORD", help="Measured motion: odometry, or local_position with attitude.")
    ] = "odometry",
    system: Annotated[
        int, typer.Option(metavar="ID", help="Our system id. ArduPilot takes RC overrides from MAV_GCS_SYSID only.")
    ] = 255,
    target_system: Annotated[int, typer.Option(metavar="ID", help="System id of the vehicle.")] = 1,
    target_component: Annotated[int, typer.Option(metavar="ID", help="Component id of its autopilot.")] = 1,
    signing_key: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE",
            help="Sign messages, and refuse those of others: 32 bytes, or a passphrase as of a ground station.",
        ),
    ] = None,
    relative: Annotated[
        bool, typer.Option("--relative", help="North and east of the reference count from where control begins.")
    ] = False,
    frame: Annotated[
        str | None, typer.Option(metavar="NAME", help="Frame of ArduSub: vectored_6dof or vectored; see `ardupilot`.")
    ] = None,
    channels: Annotated[
        str | None, typer.Option(metavar="LIST", help="Channel of each thruster: --channels=1,2,-3; see `ardupilot`.")
    ] = None,
    timeout: Annotated[
        float, typer.Option(metavar="S", help="Time without valid odometry after which the thrusters stop, s.")
    ] = 0.5,
    duration: Annotated[
        float | None, typer.Option(metavar="S", help="End after this time, s. Default: at Ctrl-C.")
    ] = None,
    unsupervised: Unsupervised = False,
    allow_code: AllowCode = False,
) -> int:
    """Control a vehicle over MAVLink, as a companion of its autopilot.

    Odometry comes in, the controller of the scenario runs, commands for the thrusters go out. It runs only while the
    vehicle is armed, which this command never does, and sends neutral commands when it stops. Before you use it on a
    vehicle, read docs/how-to/mavlink.md.
    """
    from undertow.cli import mavlink as command

    options = command.Options(
        connect, output, source, system, target_system, target_component, signing_key, relative, frame, channels,
        timeout, duration, unsupervised, allow_code,
    )  # fmt: skip
    return command.mavlink(scenario, options)


def run(
    scenario: ScenarioFile,
    link: Annotated[
        str,
        typer.Option(
            metavar="LINK",
            help="vehicle (that of the scenario, in this process), udp:HOST:PORT (a vehicle there), or log:FILE "
            "(replay the run.mcap of an earlier run and compare the commands).",
        ),
    ] = "vehicle",
    serve: Annotated[
        str | None,
        typer.Option(metavar="HOST:PORT", help="Be the simulated vehicle of a link by UDP, and listen there."),
    ] = None,
    fast: Annotated[
        bool, typer.Option("--fast", help="Do not wait: a simulated clock, and the bits of `simulate`.")
    ] = False,
    duration: Annotated[
        float | None,
        typer.Option(metavar="S", help="Default: that of the scenario; with udp, until Ctrl-C. inf: no end."),
    ] = None,
    safe: Annotated[
        str,
        typer.Option(
            metavar="NUMBERS",
            help="Output sent last, in the unit of the input: one number, or one per actuator (1,0,...).",
        ),
    ] = "0",
    deadline: Annotated[
        float | None,
        typer.Option(metavar="S", help="Time from the start of a period to its command. Default: the sampling time."),
    ] = None,
    max_age: Annotated[
        float, typer.Option(metavar="S", help="Without a measurement for so long, the run ends with the safe output.")
    ] = 0.5,
    patience: Annotated[float, typer.Option(metavar="S", help="Longest wait for the first measurement.")] = 10.0,
    priority: Annotated[
        int | None, typer.Option(metavar="1-99", help="Real-time priority of the loop (SCHED_FIFO); needs permission.")
    ] = None,
    cpu: Annotated[int | None, typer.Option(metavar="N", help="Processor on which the loop stays.")] = None,
    out: Annotated[
        Path | None, typer.Option(metavar="DIR", help="Folder for run.mcap and statistics.json. Default: runs/NAME.")
    ] = None,
    overwrite: Annotated[bool, typer.Option("--overwrite", help="Replace an earlier result.")] = False,
    as_json: Annotated[bool, typer.Option("--json", help="Print the statistics as JSON.")] = False,
    unsupervised: Unsupervised = False,
    allow_code: AllowCode = False,
) -> int:
    """Run the controller of a scenario in real time, with a link to its vehicle.

    One command per sampling time, a log of every step, and statistics of jitter, computing time and overruns. However
    the run ends, the last thing sent is the safe output. Before you use it on a vehicle, read docs/how-to/real-time.md.
    """
    from undertow.cli import run as command

    options = command.Options(
        link,
        serve,
        fast,
        duration,
        safe,
        deadline,
        max_age,
        patience,
        priority,
        cpu,
        out,
        overwrite,
        as_json,
        unsupervised,
        allow_code,
    )
    return command.run(scenario, options)


def ros2(
    scenario: ScenarioFile,
    role: Annotated[
        str, typer.Option("--as", metavar="ROLE", help="controller, or vehicle (simulated).")
    ] = "controller",
    output: Annotated[
        str | None,
        typer.Option(
            metavar="WORD",
            help="Commands of the controller: input (default; usually volts), newtons or pulses (an array, one number "
            "per thruster), or wrench.",
        ),
    ] = None,
    pace: Annotated[
        str | None,
        typer.Option(
            metavar="WORD",
            help="Of the vehicle: real-time (default), lock-step (each step waits for its command), or fast.",
        ),
    ] = None,
    use_sim_time: Annotated[
        bool, typer.Option("--use-sim-time", help="The controller takes its time from /clock.")
    ] = False,
    remap: Annotated[
        list[str] | None,
        typer.Option(
            metavar="RULE",
            help="Other name of a topic, as odom:=/vehicle/odometry. Topics: odom, target_pose, thrusters, wrench, "
            "imu, clock. Repeatable.",
        ),
    ] = None,
    rate: Annotated[
        float | None, typer.Option(metavar="HZ", help="Control steps per second. Default: those of the scenario.")
    ] = None,
    duration: Annotated[
        float | None,
        typer.Option(
            metavar="SECONDS", help="Default: that of the scenario for the vehicle, none for the controller. inf: none."
        ),
    ] = None,
    max_age: Annotated[
        float,
        typer.Option(metavar="SECONDS", help="Without a message for so long, zero thrust is commanded or applied."),
    ] = 0.5,
    domain: Annotated[int | None, typer.Option(metavar="N", help="Default: ROS_DOMAIN_ID, or 0.")] = None,
    localhost: Annotated[
        bool,
        typer.Option("--localhost", help="Reach this machine only, without multicast. Also: ROS_LOCALHOST_ONLY=1."),
    ] = False,
    reliability: Annotated[
        str, typer.Option(metavar="WORD", help="Quality of service: reliable, or best-effort.")
    ] = "reliable",
    world_frame: Annotated[
        list[str] | None,
        typer.Option(metavar="NAME", help="Frame of poses, axes east, north, up. Default: odom and map. Repeatable."),
    ] = None,
    body_frame: Annotated[
        str, typer.Option(metavar="NAME", help="Frame of the vehicle, axes forward, port, up.")
    ] = "base_link",
    bag: Annotated[
        Path | None, typer.Option(metavar="DIR", help="Record all messages that the node sends and receives.")
    ] = None,
    storage: Annotated[str, typer.Option(metavar="WORD", help="Of the bag: mcap or sqlite3.")] = "mcap",
    unsupervised: Unsupervised = False,
    allow_code: AllowCode = False,
) -> int:
    """Run the controller of a scenario, or its simulated vehicle, as a ROS 2 node. No ROS installation is needed.

    The controller takes odometry and publishes thruster commands or a wrench; the vehicle takes thruster commands and
    publishes odometry, IMU readings and /clock. World axes are east, north, up and body axes forward, port, up, as REP
    103 says. On Ctrl-C the controller commands zero thrust.
    """
    from undertow.cli import ros2 as command

    options = command.Options(
        role, output, pace, use_sim_time, remap or [], rate, duration, max_age, domain, localhost, reliability,
        world_frame or [], body_frame, bag, storage, unsupervised, allow_code,
    )  # fmt: skip
    return command.ros2(scenario, options)


def logs(
    words: Annotated[
        list[str],
        typer.Argument(
            metavar="FILE", help="A log; or `score SCENARIO FILE`; or the word `layout`, which writes one for Foxglove."
        ),
    ],
    mapping: Annotated[
        Path | None,
        typer.Option(metavar="FILE.yaml", help="Which columns of the log are which signal, in which unit and frame."),
    ] = None,
    out: Annotated[
        Path | None,
        typer.Option(
            metavar="PATH",
            help="Write the log to this .mcap or .csv file. For `score`, the folder for the results (default: "
            "runs/NAME-score); for `layout`, the .json file.",
        ),
    ] = None,
    overwrite: Annotated[bool, typer.Option("--overwrite", help="Replace an earlier file or result.")] = False,
    allow_code: AllowCode = False,
) -> int:
    """Show what is in a log, and convert it.

    The command reads MCAP, CSV, run.nc, bags of ROS 2, .bin files of ArduPilot and .ulg files of PX4, and shows the
    signals with unit, rate and gaps. `undertow logs score SCENARIO FILE` starts the model of the vehicle every 5 s from
    the logged motion, drives it with the logged commands, and reports how far it is from the log after 1, 5 and 10 s.
    """
    from undertow.cli.logs import logs

    return logs(words, mapping, out, overwrite, allow_code)


ALL = (run, export, ros2, ardupilot, mavlink, logs)
