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

from soak.input_runner import Run
from soak.links.ardupilot_run import ArdupilotRunner
from soak.links.command_process import CommandProcess, end_with_parent
from soak.links.driven_vehicle import DrivenVehicle
from soak.links.link_run import LinkRun, LinkRunner
from soak.links.mavlink_peer import MavlinkPeer
from soak.links.plan import LINKS, Plan, plan
from soak.links.ros2_peer import Ros2Peer
from soak.links.scenario import SCENARIO
from soak.links.udp_peer import UdpPeer
from soak.verdict import Failure
from undertow.core.errors import BadInput

_PACKAGES = {"mavlink-rc": ("pymavlink",), "mavlink-servo": ("pymavlink",), "ros2": ("cyclonedds", "rosbags")}
_OUTPUTS = {"mavlink-rc": "rc_override", "mavlink-servo": "servo"}
_DOMAINS = range(120, 220)  # of ROS 2
_LATEST = 900.0  # s without a run, after which a process is given up

Runner = Callable[[Plan], LinkRun]


class LinksSoakResult(NamedTuple):
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
) -> LinksSoakResult:
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
    began = time.monotonic()
    left_out = {}
    runs: dict[str, list[LinkRun]] = {}
    pipes: dict[Any, str] = {}
    processes = []
    context = multiprocessing.get_context("spawn")
    for link in links:
        if missing := [package for package in _PACKAGES.get(link, ()) if importlib.util.find_spec(package) is None]:
            left_out[link] = f"{missing[0]} is not installed"
            continue
        pipe, sender = context.Pipe()
        folder_of_link = folder / link
        folder_of_link.mkdir()
        limit = until - time.monotonic()
        processes.append(
            context.Process(target=_attack_link, args=(run, link, number, seed, str(folder_of_link), limit, sender))
        )
        processes[-1].start()
        sender.close()
        pipes[pipe], runs[link] = link, []
    try:
        while pipes:
            ready: list[Any] = wait(list(pipes), _LATEST)
            if not ready:
                left_out |= dict.fromkeys(pipes.values(), f"no run within {_LATEST:g} s")
                break
            failures_of_last_runs: list[Failure] = []
            for pipe in ready:
                try:
                    runs[pipes[pipe]].append(pipe.recv())
                    failures_of_last_runs += runs[pipes[pipe]][-1].failures
                except EOFError:
                    del pipes[pipe]
            watch({link: len(runs_of_link) for link, runs_of_link in runs.items()}, failures_of_last_runs)
    finally:
        for process in processes:
            process.terminate() if pipes else process.join()
    all_runs = [link_run for runs_of_link in runs.values() for link_run in runs_of_link]
    failures = [failure for link_run in all_runs for failure in link_run.failures]
    for link, runs_of_link in runs.items():
        if len(runs_of_link) < number and time.monotonic() < until:
            failures.append(
                Failure("N3", f"links/{link}/{seed}/{len(runs_of_link)}", "the process that attacks it ended")
            )
    rows = [_row(link, runs_of_link) for link, runs_of_link in runs.items() if runs_of_link]
    return LinksSoakResult(len(all_runs), left_out, rows, _worst(all_runs), failures, time.monotonic() - began)


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
    vehicle = DrivenVehicle(scenario)
    log = None
    if link == "run":
        peer = UdpPeer(str(folder / "out"))
        log = folder / "out" / "run.mcap"
    elif link == "ros2":
        domain = random.Random(f"{seed}/{os.getpid()}").choice(_DOMAINS)
        peer = Ros2Peer(domain, str(folder / "bag"))
        log = folder / "bag"
    else:
        peer = MavlinkPeer(vehicle.vehicle, _OUTPUTS[link])
    return LinkRunner(command, peer, vehicle, scenario, log, stops_itself=link == "ros2").run


def _row(link: str, runs: Sequence[LinkRun]) -> dict[str, Any]:
    undisturbed = [run for run in runs if not run.plan.events and run.plan.disk is None]
    largest = lambda values: float(np.max(list(values), initial=0.0))
    return {
        "link": link,
        "runs": len(runs),
        "failed": sum(bool(run.failures) for run in runs),
        "undisturbed_volt_seconds": largest(run.volt_seconds for run in undisturbed),
        "worst_volt_seconds": largest(run.volt_seconds for run in runs),
        "full_after_one": largest(run.longest_full for run in runs if run.plan.is_single),
        "full": largest(run.longest_full for run in runs),
        "furthest": largest(run.furthest for run in runs),
        "neutral_after": largest(run.neutral_after for run in runs),
    }


def _worst(runs: Sequence[LinkRun], number: int = 10) -> list[dict[str, Any]]:
    """The runs with the most volt-seconds."""
    worst_runs = sorted(runs, key=lambda run: -run.volt_seconds)[:number]
    return [
        {
            "identity": run.plan.identity,
            "volt_seconds": run.volt_seconds,
            "full": run.longest_full,
            "plan": str(run.plan),
        }
        for run in worst_runs
    ]
