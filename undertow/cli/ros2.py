"""`undertow ros2`: the controller of a scenario, or its simulated vehicle, as a ROS 2 node."""

import contextlib
import os
from collections.abc import Callable, Iterator
from typing import Any

from undertow.cli.exit_codes import DONE, FILES_FAILED, RUN_FAILED, complain, report
from undertow.cli.interruptible import interruptible
from undertow.cli.options.ros2 import Ros2Command
from undertow.cli.paced_loop import run_until_signal
from undertow.core import checks
from undertow.core.errors import BadInput
from undertow.core.status import Status
from undertow.logs.background_writer import BackgroundWriter
from undertow.outside.autopilot.vehicle import Vehicle
from undertow.outside.realtime.loop_settings import LoopSettings
from undertow.outside.ros2.checked_scenario import check_vehicle
from undertow.outside.ros2.compiled_controller import CompiledController
from undertow.outside.ros2.controller_link import ControllerLink, ControllerSettings
from undertow.outside.ros2.from_messages import Frames
from undertow.outside.ros2.link import Link
from undertow.outside.ros2.node import Reporter, Topics
from undertow.outside.ros2.vehicle_node import VehicleNode, VehicleSettings
from undertow.outside.ros2.write_bag import BagWriter
from undertow.scenario.build import build
from undertow.scenario.reading import read

ROLES = ("controller", "vehicle")

Run = Callable[[Any], int]  # runs a node over a link until it ends


def ros2(command: Ros2Command) -> int:
    """Run a node until it ends or is interrupted; return the exit code."""
    checks.choice("--as", command.role, ROLES)
    for name, role, value in (
        ("--pace", "vehicle", command.pace),
        ("--output", "controller", command.output),
        ("--use-sim-time", "controller", command.use_sim_time or None),
        ("--unsupervised", "controller", command.unsupervised or None),
        ("--log", "controller", command.log),
    ):
        if value is not None and role != command.role:
            raise BadInput(name, f"be left out with --as {command.role}", value)
    names = Topics().remapped(command.remap or [])
    frames = Frames(tuple(command.world_frame or ()) or Frames().world, command.body_frame)
    reporter = Reporter(report)
    domain = _domain(command.domain)
    localhost = command.localhost or _environment_says_localhost()
    bag = None if command.bag is None else BagWriter(command.bag, command.storage)
    reporter.say(f"compiling the {command.role}")
    compiled = _compiled_controller if command.role == "controller" else _compiled_vehicle
    run = compiled(command, names, frames, reporter)
    missing: list[str] = []
    with _recording(bag, missing) as recording, Link(domain, localhost, command.reliability, recording) as link:
        link.on_trouble = reporter.trouble
        code = run(link)
    return max(code, FILES_FAILED if missing else DONE)


@contextlib.contextmanager
def _recording(bag: Any, missing: list[str]) -> Iterator[BackgroundWriter | None]:
    """The bag, written in a thread; what is missing in it is said at the end, and added to a list."""
    if bag is None:
        yield None
        return
    recording = BackgroundWriter(bag.open)
    try:
        yield recording
    finally:
        recording.close()
        missing += recording.missing("messages")
        for sentence in missing:
            complain(f"{bag.folder}: {sentence}")


def _compiled_controller(command: Ros2Command, names: Any, frames: Any, reporter: Any) -> Run:
    if command.duration is not None:
        checks.positive("--duration", command.duration, "s", finite=False)
    options_of_law = {"unsupervised": command.unsupervised, "allow_code": command.allow_code}
    make_controller = lambda: CompiledController(
        command.scenario, command.output or "input", command.rate, **options_of_law
    )
    controller = interruptible(make_controller)
    settings = ControllerSettings(command.max_age, command.use_sim_time, names, frames)

    def run(link: Any) -> int:
        topics = ControllerLink(controller, link, settings, reporter)
        reporter.say(f"{names.odom}, {names.target_pose} -> {topics.topic}. To end: Ctrl-C")
        loop = LoopSettings(max_age=command.max_age)
        return run_until_signal(controller.autopilot, topics, loop, command.duration, reporter.say, command.log)

    return run


def _compiled_vehicle(command: Ros2Command, names: Any, frames: Any, reporter: Any) -> Run:
    if command.rate is not None:
        checks.positive("--rate", command.rate, "Hz")
    period = None if command.rate is None else 1 / command.rate
    pace = command.pace or "real-time"
    duration = command.duration
    settings = VehicleSettings(pace, duration, command.max_age, topics=names, frames=frames)

    def made() -> Vehicle:
        built = build(read(command.scenario, allow_code=command.allow_code))
        check_vehicle(built)
        return Vehicle(built, sampling_time=period, attitude="quaternion")

    vehicle = interruptible(made)

    def run(link: Any) -> int:
        node = VehicleNode(vehicle, link, settings, reporter)
        reporter.say(f"{names.thrusters} -> {names.odom}, {names.imu}, {names.clock}. To end: Ctrl-C")
        try:
            status = node.run()
        finally:
            reporter.say(f"ended: {node.status()}")
        if status is Status.OK:
            return DONE
        complain(f"the run ended as `{status.word}`. {status.sentence}")
        return RUN_FAILED

    return run


def _domain(number: int | None) -> int:
    """The domain: as given, or that of ROS_DOMAIN_ID, or 0."""
    text = os.environ.get("ROS_DOMAIN_ID") or "0"
    if number is None and not text.isdecimal():
        raise BadInput("ROS_DOMAIN_ID", "be a whole number", repr(text))
    return int(text) if number is None else number


def _environment_says_localhost() -> bool:
    """Whether the variables of ROS 2 keep its nodes on this machine."""
    range_is_localhost = os.environ.get("ROS_AUTOMATIC_DISCOVERY_RANGE", "").upper() == "LOCALHOST"
    return range_is_localhost or os.environ.get("ROS_LOCALHOST_ONLY") == "1"
