"""`undertow run`: the controller of a scenario in real time, with a link to its vehicle."""

import contextlib
import dataclasses
import json
import math
import os
import platform
import time
from pathlib import Path
from typing import Any

import numpy as np
import typer

from undertow.cli.exit_codes import DONE, FILES_FAILED, RUN_FAILED, complain
from undertow.cli.interruptible import EndingSignal, interruptible
from undertow.cli.options.run import RunCommand
from undertow.cli.results_folder import check_folder, output_folder, remove
from undertow.cli.stages import stage
from undertow.cli.step_logs import logging_to
from undertow.cli.tables import numbers, print_lines, terminal_table, titled, wide_console
from undertow.control.supervision.conditions import State
from undertow.control.supervision.transition_log import SupervisorTransition
from undertow.core import checks
from undertow.core.atomic_io import sync, write_whole
from undertow.core.errors import BadInput
from undertow.logs.read import read_log
from undertow.outside.autopilot.autopilot import Autopilot
from undertow.outside.autopilot.measured_motion import Format
from undertow.outside.realtime.control_loop import RealTimeLoop
from undertow.outside.realtime.link import AbstractLink
from undertow.outside.realtime.log_link import LogLink
from undertow.outside.realtime.loop_clock import MonotonicClock, SimulatedClock
from undertow.outside.realtime.loop_settings import LoopSettings, Reason
from undertow.outside.realtime.loop_statistics import LoopStatistics
from undertow.outside.realtime.process_priority import scheduled
from undertow.outside.realtime.udp_link import UdpVehicleLink, UdpVehicleServer
from undertow.outside.realtime.vehicle_link import VehicleLink
from undertow.report.answers.realtime_answer import answer_of_realtime_run
from undertow.report.run_tables import transition_rows
from undertow.scenario.build import Built, build
from undertow.scenario.link_scenario import at_sampling_time, read_for_link
from undertow.scenario.reading import Text, dump

_BEFORE = ".unbegun"  # where the log is before the first step, when an earlier one is still there
_WRITTEN = ("run.mcap", "statistics.json", "scenario.yaml")
_MOST_READ = 200_000  # steps of a log that is read for the answer, half an hour at 100 Hz: that takes twenty seconds


def run(command: RunCommand) -> int:
    """Run until the end of the scenario, of the link, or Ctrl-C; return the exit code."""
    _check(command)
    text = read_for_link(command.scenario, allow_code=command.allow_code, unsupervised=command.unsupervised)
    built = interruptible(lambda: build(text))
    if built.scenario.loop.kind != "sampled":
        raise BadInput("loop.kind", "be sampled for `undertow run`", built.scenario.loop.kind)
    if command.serve is not None:
        return _serve(built, command)
    if command.link.startswith("log:"):
        return _replay(text, built, command)
    return _controlled(built, command)


def _check(command: RunCommand) -> None:
    kind, colon, address = command.link.partition(":")
    if not (command.link == "vehicle" or (kind in ("udp", "log") and colon and address)):
        raise BadInput("--link", "be vehicle, udp:HOST:PORT or log:FILE", repr(command.link))
    if command.fast and kind == "udp":
        raise BadInput("--fast", "be left out with a link to a real vehicle", command.link)
    for name in ("duration", "deadline", "max_age", "patience"):
        value = getattr(command, name)
        if value is not None:
            checks.positive(f"--{name.replace('_', '-')}", value, "s", finite=name != "duration")


def _controlled(built: Built, command: RunCommand) -> int:
    """The loop with the vehicle of the scenario, or one behind UDP, with a log."""
    simulated = command.link == "vehicle"
    period = float(built.scenario.loop.dt)
    stop = EndingSignal()
    duration = command.duration or (built.scenario.loop.duration if simulated else math.inf)
    steps = duration if math.isinf(duration) else round(duration / period)
    if steps < 1:
        raise BadInput("--duration", f"be at least one sampling time ({period:g} s)", f"{duration:g} s")
    safe = _safe(command.safe, built.closed_loop.plant.inputs())
    settings = LoopSettings(safe, command.deadline, command.max_age, command.patience)
    clock = SimulatedClock() if command.fast else MonotonicClock()
    with scheduled(command.priority, command.cpu):  # whether it is permitted, before anything is written
        pass
    with output_folder(command.out, Path("runs") / command.scenario.stem) as folder:
        check_folder(folder, _WRITTEN, "run.mcap", command.overwrite)
        for advice in built.advice():
            typer.echo(f"Advice: {advice.sentence}", err=True)
        link = VehicleLink(built) if simulated else UdpVehicleLink(command.link.removeprefix("udp:"), built)
        built_for_link = built if simulated else _starting_anywhere(built)
        troubles: list[str] = []
        with contextlib.nullcontext() if command.as_json else stage(wide_console(), "compiling"):
            autopilot = interruptible(lambda: _autopilot(built_for_link, link.form or Format()))
        (folder / _BEFORE).mkdir(parents=True, exist_ok=True)
        with logging_to(folder / _BEFORE / "run.mcap", autopilot, troubles):  # see `_begin_log`
            loop = RealTimeLoop(autopilot, link, clock, settings, stop.asked, lambda: _begin_log(folder))
            say = (lambda line: None) if command.as_json else typer.echo
            say(f"Link {command.link}, {1 / period:g} Hz, log {folder / 'run.mcap'}. To end: Ctrl-C")
            with stop.listening(), scheduled(command.priority, command.cpu):
                reason = loop.run(periods=steps)
        if loop.statistics.steps:
            statistics = _data(loop.statistics, link, autopilot, reason, command)
            texts = {"scenario.yaml": dump(built.resolved), "statistics.json": json.dumps(statistics, indent=2) + "\n"}
            for name, text in texts.items():
                try:
                    write_whole(folder / name, text)
                except OSError as error:
                    troubles.append(f"{folder / name} could not be written: {error.strerror or error}")
            _print(statistics, command.as_json)
            if not command.as_json:
                _answer(statistics, built, folder, troubles)
        else:
            remove(folder / _BEFORE)
            with contextlib.suppress(OSError):  # it held something before
                folder.rmdir()
    for trouble in troubles:
        complain(trouble)
    return max(_ending(reason, link, command, stop), FILES_FAILED if troubles else DONE)


def _safe(text: str, actuators: int) -> Any:
    """The safe output: one number, or one per actuator separated by commas."""
    try:
        outputs = [float(number) for number in text.split(",")]
    except ValueError:
        raise BadInput("--safe", "be a number, or one per actuator separated by commas", repr(text)) from None
    checks.finite("--safe", np.array(outputs))
    if len(outputs) not in (1, actuators):
        raise BadInput("--safe", f"be one number, or {actuators} separated by commas", len(outputs))
    return outputs if len(outputs) > 1 else outputs[0]


def _starting_anywhere(built: Built) -> Built:
    """With the reference as the scenario gives it: it begins where the vehicle is found."""
    return built._replace(closed_loop=dataclasses.replace(built.closed_loop, reference=built.reference))


def _begin_log(folder: Path) -> None:
    """The vehicle has answered: the log takes the place of an earlier result, which stays where no vehicle does."""
    os.replace(folder / _BEFORE / "run.mcap", folder / "run.mcap")
    sync(folder)
    for name in (*_WRITTEN[1:], _BEFORE):
        remove(folder / name)


def _autopilot(built: Built, form: Format) -> Autopilot:
    return Autopilot(built, attitude=form.attitude, velocity=form.velocity, log_later=True)


def _data(
    statistics: LoopStatistics, link: AbstractLink, autopilot: Autopilot, reason: Reason, command: RunCommand
) -> dict[str, Any]:
    """Everything about a run as JSON; times in s."""
    machine = {"python": platform.python_version(), "system": platform.platform(), "processors": os.cpu_count()}
    return {
        "link": command.link,
        "clock": "simulated" if command.fast else "monotonic",
        "ended": link.ended or reason.value,
        "sampling_time": autopilot.sampling_time,
        "deadline": command.deadline or autopilot.sampling_time,
        "backend": autopilot.backend,
        **statistics.as_data(),
        **_supervision(autopilot),
        "link_counts": dict(link.counts()),
        "autopilot_counts": autopilot.counts,
        "machine": machine | {"priority": command.priority, "processor": command.cpu},
    }


def _supervision(autopilot: Autopilot) -> dict[str, Any]:
    """Transitions of the supervisor; nothing without one, or where no step was taken."""
    if not autopilot.supervised:
        return {}
    return {
        "transitions": [
            transition._asdict() | {"state": transition.state.name} for transition in autopilot.transitions()
        ]
    }


def _answer(statistics: dict[str, Any], built: Built, folder: Path, troubles: list[str]) -> None:
    """Say whether the vehicle held its reference, and where the results are."""
    path = folder / "run.mcap"
    console = wide_console()
    log = None
    if statistics["steps"] <= _MOST_READ and not troubles:
        with stage(console, "reading the log"), contextlib.suppress(BadInput, OSError):
            log = read_log(path)
    answer = answer_of_realtime_run(log, built.closed_loop.plant.output_units, built.criterion(), statistics)
    again = f"Next: undertow run {folder / 'scenario.yaml'} --link log:{path} computes the commands once more."
    print_lines(console, [*answer.text, f"Results: {folder}", again])


def _print(statistics: dict[str, Any], as_json: bool) -> None:
    if as_json:
        typer.echo(json.dumps(statistics, indent=2))
        return
    console = wide_console()
    longest = 1e3 * statistics["longest_stale"]
    if statistics["clock"] == "monotonic":
        table = titled("Times, ms", "", *(numbers(name) for name in ("mean", "p50", "p99", "p99.9", "max")))
        for name in ("computing", "lateness", "jitter"):
            if statistics[name]:
                cells = (f"{1e3 * statistics[name][share]:.3f}" for share in ("mean", "p50", "p99", "p99.9", "max"))
                table.add_row({"lateness": "late start", "jitter": "jitter of the period"}.get(name, name), *cells)
        console.print(table)
    table = titled("Counts", "", numbers("number"))
    for name in ("steps", "overruns", "missed", "stale"):
        labels = {"missed": "missed periods", "stale": f"without a new measurement (longest {longest:.0f} ms)"}
        table.add_row(labels.get(name, name), str(statistics[name]))
    for name, number in statistics["link_counts"].items():
        if number:
            table.add_row(f"link: {name}", str(number))
    if statistics["autopilot_counts"]["not recorded"]:
        table.add_row("not recorded: the disk was too slow", str(statistics["autopilot_counts"]["not recorded"]))
    console.print(table)
    if "transitions" in statistics:
        transitions = [
            SupervisorTransition(**transition | {"state": State[transition["state"]]})
            for transition in statistics["transitions"]
        ]
        console.print(terminal_table(transition_rows(transitions)))


def _ending(reason: Reason, link: AbstractLink, command: RunCommand, stop: EndingSignal) -> int:
    """The exit code, with a line about a failure."""
    if reason is Reason.STOPPED:
        return stop.exit_code
    if link.failed:
        complain(link.ended)
    elif reason is Reason.LINK_LOST:
        complain(f"no measurement for {command.max_age:g} s: the safe output was sent, and the run ended")
    elif reason is Reason.STALLED:
        cause = "the controller stood still for longer than --max-age"
        complain(f"{cause} ({command.max_age:g} s): the safe output was sent, and the run ended")
    elif reason is Reason.NO_START:
        complain(f"no first measurement within {command.patience:g} s over {command.link}; nothing was written")
    failed = (Reason.LINK_LOST, Reason.STALLED, Reason.NO_START)
    return RUN_FAILED if link.failed or reason in failed else DONE


def _replay(text: Text, built: Built, command: RunCommand) -> int:
    """Feed a log to the controller, and compare the commands."""
    link = LogLink(Path(command.link.removeprefix("log:")), built.closed_loop.plant)
    form = link.form or Format()
    if link.precision != built.scenario.precision:
        raise BadInput("precision", f"be {link.precision}, as in the log", built.scenario.precision)
    same_rate = lambda: build(at_sampling_time(text, link.sampling_time))
    autopilot = interruptible(lambda: Autopilot(same_rate(), attitude=form.attitude, velocity=form.velocity))
    for note in link.notes:
        typer.echo(f"Note: {note}", err=True)
    reason = RealTimeLoop(autopilot, link, SimulatedClock()).run()
    replayed = link.counts()["replayed"]
    differences = link.differences()
    data = {
        "replayed": replayed,
        "ended": reason.value,
        "differences": [difference._asdict() for difference in differences],
    }
    if command.as_json:
        typer.echo(json.dumps(data, indent=2))
    elif differences:
        unit = autopilot.unit
        table = titled("Commands that differ", "actuator", *map(numbers, ("steps", "first, s", f"largest, {unit}")))
        for difference in differences:
            table.add_row(
                difference.actuator, str(difference.steps), f"{difference.first:.6g}", f"{difference.largest:.3g}"
            )
        wide_console().print(table)
    else:
        typer.echo(f"{replayed} steps replayed: every bit of the commands is that of the log.")
    if differences:
        differing_steps = max(difference.steps for difference in differences)
        complain(f"the commands of {differing_steps} or more of {replayed} steps differ from the log")
    return RUN_FAILED if differences else DONE


def _serve(built: Built, command: RunCommand) -> int:
    """Be the simulated vehicle at the other end of a link by UDP."""
    stop, server = EndingSignal(), interruptible(lambda: UdpVehicleServer(built, str(command.serve)))
    typer.echo(f"The vehicle listens on {command.serve}. To end: Ctrl-C")
    end = math.inf if command.duration is None else time.monotonic() + command.duration
    try:
        with stop.listening():
            server.serve(lambda: stop.asked() or time.monotonic() >= end)
    finally:
        server.close()
    counts = ", ".join(f"{number} {name}" for name, number in server.counts().items() if number)
    typer.echo(
        f"Ended. Commands: {counts or 'none'}. The last one: {np.array2string(server.last_command, precision=4)}"
    )
    if server.ended:
        complain(server.ended)
    return RUN_FAILED if server.ended else stop.exit_code
