"""Link commands under signals, standstills, wrong messages and full disks: many runs of each, a process per link."""

import importlib.util
import multiprocessing
import os
import random
import signal
import time
from collections.abc import Callable, Mapping, Sequence
from multiprocessing.connection import Connection, wait
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from soak.links.ardupilot_run import ArdupilotRunner
from soak.links.command_process import CommandProcess, end_with_parent
from soak.links.driven_vehicle import DrivenVehicle
from soak.links.link_run import LinkRun, LinkRunner
from soak.links.mavlink_peer import MavlinkPeer
from soak.links.plan import LINKS, Plan, plan
from soak.links.ros2_peer import Ros2Peer
from soak.links.scenario import SCENARIO
from soak.links.udp_peer import UdpPeer
from soak.trying import Run
from soak.verdict import Failure
from undertow.core.errors import BadInput

_PACKAGES = {"mavlink-rc": ("pymavlink",), "mavlink-servo": ("pymavlink",), "ros2": ("cyclonedds", "rosbags")}
_OUTPUTS = {"mavlink-rc": "rc_override", "mavlink-servo": "servo"}
_DOMAINS = range(120, 220)  # of ROS 2
_LATEST = 900.0  # s without a run, after which a process is given up

Runner = Callable[[Plan], LinkRun]


class Links(NamedTuple):
    """Result of many runs.

    Attributes:
        number: of runs.
        left_out: links whose package is not installed, or that were given up, with the reason.
        rows: one for each link: runs, never-events, volt-seconds of the undisturbed and of the worst run, longest full
            thrust with at most one wrong message and with any, longest time to neutral, endings.
        worst: the runs with the most volt-seconds, in words.
        failures: never-events.
        seconds: elapsed time.
    """

    number: int
    left_out: dict[str, str]
    rows: list[dict[str, Any]]
    worst: list[dict[str, Any]]
    failures: list[Failure]
    seconds: float


def attack_links(
    run: Run,
    number: int,
    seed: int,
    folder: Path,
    links: Sequence[str] = LINKS,
    until: float = float("inf"),
    watch: Callable[[Mapping[str, int], Sequence[Failure]], None] = lambda done, failures: None,
) -> Links:
    """Run every link command so many times, each time attacked in another way.

    Args:
        run: `undertow` with arguments, in the process that calls it; what it compiles may be kept from call to call.
        number: of runs of each link.
        seed: of the plans.
        folder: for scenarios and logs; empty.
        links: some of `plan.LINKS`.
        until: time of `time.monotonic` after which no further run begins.
        watch: called with the number of runs that are done, by link, and the never-events of the last ones.
    """
    began, left_out = time.monotonic(), {}
    runs: dict[str, list[LinkRun]] = {}
    pipes: dict[Any, str] = {}
    processes, context = [], multiprocessing.get_context("spawn")
    for link in links:
        if missing := [one for one in _PACKAGES.get(link, ()) if importlib.util.find_spec(one) is None]:
            left_out[link] = f"{missing[0]} is not installed"
            continue
        pipe, other = context.Pipe()
        own = folder / link
        own.mkdir()
        limit = until - time.monotonic()
        processes.append(context.Process(target=_attack_link, args=(run, link, number, seed, str(own), limit, other)))
        processes[-1].start()
        other.close()
        pipes[pipe], runs[link] = link, []
    try:
        while pipes:
            ready: list[Any] = wait(list(pipes), _LATEST)
            if not ready:
                left_out |= dict.fromkeys(pipes.values(), f"no run within {_LATEST:g} s")
                break
            found: list[Failure] = []
            for pipe in ready:
                try:
                    runs[pipes[pipe]].append(pipe.recv())
                    found += runs[pipes[pipe]][-1].failures
                except EOFError:
                    del pipes[pipe]
            watch({link: len(each) for link, each in runs.items()}, found)
    finally:
        for process in processes:
            process.terminate() if pipes else process.join()
    every = [one for each in runs.values() for one in each]
    failures = [failure for one in every for failure in one.failures]
    for link, each in runs.items():
        if len(each) < number and time.monotonic() < until:
            failures.append(Failure("N3", f"links/{link}/{seed}/{len(each)}", "the process that attacks it ended"))
    rows = [_row(link, each) for link, each in runs.items() if each]
    return Links(len(every), left_out, rows, _worst(every), failures, time.monotonic() - began)


def replay(run: Run, identity: str, folder: Path) -> LinkRun:
    """Repeat a run; the moment at which a signal meets a command is not the same to the microsecond."""
    _, link, seed, number = identity.split("/")
    if link not in LINKS:
        raise BadInput("--replay", f"be of a link ({', '.join(LINKS)})", link)
    command = CommandProcess(run, folder)
    try:
        return _runner(link, command, folder, int(seed))(plan(link, int(seed), int(number)))
    finally:
        command.kill()


def _attack_link(run: Run, link: str, number: int, seed: int, folder: str, limit: float, pipe: Connection) -> None:
    """A process that attacks one link, and sends what happened in each run."""
    began = time.monotonic()
    signal.signal(signal.SIGTERM, _leave)
    end_with_parent()
    command = CommandProcess(run, Path(folder))
    try:
        runner = _runner(link, command, Path(folder), seed)
        for k in range(number):
            if time.monotonic() - began > limit:
                break
            pipe.send(runner(plan(link, seed, k)))
    except (KeyboardInterrupt, BrokenPipeError):
        pass
    finally:
        command.kill()


def _leave(number: int, frame: Any) -> None:
    raise KeyboardInterrupt


def _runner(link: str, command: CommandProcess, folder: Path, seed: int) -> Runner:
    """What runs the plans of a link. Optional packages are imported where they are needed."""
    scenario = folder / "scenario.yaml"
    scenario.write_text(SCENARIO, encoding="utf-8")
    if link == "ardupilot":
        return ArdupilotRunner(command, scenario).run
    vehicle, log = DrivenVehicle(scenario), None
    if link == "run":
        peer, log = UdpPeer(str(folder / "out")), folder / "out" / "run.mcap"
    elif link == "ros2":
        domain = random.Random(f"{seed}/{os.getpid()}").choice(_DOMAINS)
        peer, log = Ros2Peer(domain, str(folder / "bag")), folder / "bag"
    else:
        peer = MavlinkPeer(vehicle.vehicle, _OUTPUTS[link])
    return LinkRunner(command, peer, vehicle, scenario, log, stops_itself=link == "ros2").run


def _row(link: str, runs: Sequence[LinkRun]) -> dict[str, Any]:
    undisturbed = [one for one in runs if not one.plan.events and one.plan.disk is None]
    largest = lambda values: float(np.max(list(values), initial=0.0))
    return {
        "link": link,
        "runs": len(runs),
        "failed": sum(bool(one.failures) for one in runs),
        "undisturbed_volt_seconds": largest(one.volt_seconds for one in undisturbed),
        "worst_volt_seconds": largest(one.volt_seconds for one in runs),
        "full_after_one": largest(one.longest_full for one in runs if one.plan.is_single),
        "full": largest(one.longest_full for one in runs),
        "furthest": largest(one.furthest for one in runs),
        "neutral_after": largest(one.neutral_after for one in runs),
    }


def _worst(runs: Sequence[LinkRun], number: int = 10) -> list[dict[str, Any]]:
    """The runs with the most volt-seconds."""
    chosen = sorted(runs, key=lambda one: -one.volt_seconds)[:number]
    return [
        {
            "identity": one.plan.identity,
            "volt_seconds": one.volt_seconds,
            "full": one.longest_full,
            "plan": str(one.plan),
        }
        for one in chosen
    ]
