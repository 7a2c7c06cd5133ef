"""A whole soak: its parts one after the other, with what each counted, as one set of plain data."""

import contextlib
import importlib.metadata
import io
import json
import os
import platform
import tempfile
import time
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

from soak import controls, faults_soak, hours_soak, kills, links_soak
from soak.input_runner import Run, try_in_process
from soak.input_soak import try_inputs
from soak.inputs import KINDS, Attack, attack
from soak.sample_files import material
from soak.verdict import EVENTS, Failure, failure_of
from undertow.core.errors import BadInput, did_you_mean

PARTS = ("inputs", "kills", "hours", "faults", "controls", "links")

Watch = Callable[[str, str], None]  # called with the name of a part and its progress in words


class Amounts(NamedTuple):
    """How much of each part.

    Attributes:
        inputs, kills, faults: numbers of hostile inputs, ended processes, runs with faults.
        hours: vehicle-hours.
        short_controls: fewer controls or all.
        links: runs of each link command.
    """

    inputs: int = 2000
    kills: int = 5
    hours: float = 4.0
    faults: int = 500
    short_controls: bool = False
    links: int = 20


# Under a minute on two cores.
SHORT = Amounts(inputs=300, kills=0, hours=0.2, faults=0, short_controls=True, links=0)


class Soaked(NamedTuple):
    """Result of a soak: plain data for soak.json, and the hostile inputs that failed."""

    summary: dict[str, Any]
    attacks: list[tuple[Failure, Attack]]

    @property
    def passed(self) -> bool:
        """Whether no never-event occurred."""
        return not self.summary["failures"]


def soak(
    run: Run,
    parts: Sequence[str],
    amounts: Amounts,
    seed: int,
    minutes: float = float("inf"),
    watch: Watch | None = None,
    run_link: Run | None = None,
) -> Soaked:
    """Run parts of a soak.

    Args:
        run: `undertow` with arguments, in the process that calls it.
        parts: some of `PARTS`, in their order.
        amounts: how much of each.
        seed: of everything random.
        minutes: after which no further input, campaign, loop or block of runs begins; the parts that are left share
            what is left of it.
        watch: called with the progress.
        run_link: as `run`, for the commands of links; it may keep what it compiles from call to call. None for `run`.
    """
    began = time.monotonic()
    report = watch or (lambda part, words: None)
    results: dict[str, Any] = {}
    failures: list[Failure] = []
    attacks: list[tuple[Failure, Attack]] = []
    with tempfile.TemporaryDirectory(prefix="undertow-soak-", ignore_cleanup_errors=True) as name:
        for number, part in enumerate(parts):
            seconds_left = began + 60.0 * minutes - time.monotonic()
            until = time.monotonic() + seconds_left / (len(parts) - number)
            folder = Path(name) / part
            folder.mkdir()
            caller = run_link if part == "links" and run_link is not None else run
            result, part_failures, part_attacks = _PARTS[part](caller, amounts, seed, folder, until, report)
            results[part] = result
            failures += part_failures
            attacks += part_attacks
    counted = Counter(failure.event for failure in failures)
    summary = {
        "title": "Soak of undertow",
        "version": importlib.metadata.version("undertow"),
        "python": platform.python_version(),
        "machine": f"{platform.machine()}, {os.cpu_count()} cores",
        "seed": seed,
        "seconds": round(time.monotonic() - began, 1),
        "events": {event: counted.get(event, 0) for event in EVENTS},
        "meanings": EVENTS,
        "parts": results,
        "failures": [failure._asdict() for failure in failures],
    }
    return Soaked(summary, attacks)


def replayed(run: Run, identity: str, run_link: Run | None = None) -> tuple[Failure | None, str]:
    """Repeat one input or run by its identity; the never-event if it occurs again, and what happened in words.

    Args:
        run, run_link: as of `soak`.
        identity: such as inputs/scenario/7/123, faults/7/12, hours/0/24/7, controls/D3 or links/mavlink-rc/7/12.

    Raises:
        BadInput: no such identity, or one of a kill, whose moment cannot be repeated.
    """
    part, *fields = identity.split("/")
    try:
        if part == "inputs":
            return _replayed_input(run, *fields)
        if part in ("hours", "faults"):
            judged_run = hours_soak.replay(identity) if part == "hours" else faults_soak.replay(identity)[1]
            failures = [Failure(event, identity, message) for event, message in judged_run.events()]
            words = f"{judged_run.status.word} at {judged_run.ended:g} s, digest {judged_run.digest}"
            return (failures[0] if failures else None), words
        if part == "links":
            return _replayed_link(run_link or run, identity)
        if part == "controls":
            controls_by_identity = {control.identity: control for control in controls.CONTROLS}
            row = controls.judged_control(controls_by_identity[fields[0]])
            return None, f"{row['found']}; beside it: {row['beside']}"
    except (KeyError, ValueError, IndexError, TypeError):
        pass
    hint = "Identities are in soak.json, such as inputs/scenario/7/123, faults/7/12, hours/0/24/7 or controls/D3"
    raise BadInput("--replay", "be a file soak.json or the identity of a failure", identity, hint=hint)


def _replayed_input(run: Run, kind: str, seed: str, number: str) -> tuple[Failure | None, str]:
    hostile_input = attack(kind, int(seed), int(number), valid_files(run))
    with tempfile.TemporaryDirectory(prefix="undertow-soak-") as name:
        result = try_in_process(run, hostile_input, Path(name))
    failure = failure_of(hostile_input.identity, hostile_input.arguments, hostile_input.files, result)
    return failure, f"undertow {' '.join(hostile_input.arguments)}: exit code {result.code}. {result.err.strip()}"


def _replayed_link(run: Run, identity: str) -> tuple[Failure | None, str]:
    with tempfile.TemporaryDirectory(prefix="undertow-soak-") as name:
        link_run = links_soak.replay(run, identity, Path(name))
    words = (
        f"{link_run.plan}: exit code {link_run.code}, {link_run.volt_seconds:.0f} V s, "
        f"full thrust for {link_run.longest_full:.2f} s"
    )
    return (link_run.failures[0] if link_run.failures else None), words


def valid_files(run: Run) -> dict[str, bytes]:
    """The files that hostile ones are made of; what their commands print is left out."""
    with contextlib.redirect_stdout(io.StringIO()), contextlib.redirect_stderr(io.StringIO()):
        return material(run)


def identities(path: Path) -> list[str]:
    """Identities of the failures in a soak.json.

    Raises:
        BadInput: it cannot be read, or is another file.
    """
    try:
        data = json.loads(path.read_text(encoding="utf-8"))
        return [str(failure["identity"]) for failure in data["failures"]]
    except (OSError, ValueError, KeyError, TypeError, RecursionError):
        raise BadInput("--replay", "be a file soak.json or the identity of a failure", str(path)) from None


def check_parts(parts: Sequence[str]) -> list[str]:
    """Parts in their order, without repetitions; all of them where none is named.

    Raises:
        BadInput: an unknown part.
    """
    for part in parts:
        if part not in PARTS:
            raise BadInput("PART", "be a part of a soak", part, hint=did_you_mean(part, PARTS))
    return [part for part in PARTS if part in parts or not parts]


Described = tuple[dict[str, Any], list[Failure], list[tuple[Failure, Attack]]]


def _inputs(run: Run, amounts: Amounts, seed: int, folder: Path, until: float, report: Watch) -> Described:
    report("inputs", "preparing valid files")
    watch = _seldom(lambda done, failed: report("inputs", f"{done} of {amounts.inputs}, {failed} failed"))
    tried = try_inputs(run, amounts.inputs, seed, valid_files(run), folder, until=until, watch=watch)
    result = tried._asdict() | {"number": tried.number, "asked": amounts.inputs, "kinds": list(KINDS)}
    del result["failures"]
    return result, [failure for failure, _ in tried.failures], tried.failures


def _kills(run: Run, amounts: Amounts, seed: int, folder: Path, until: float, report: Watch) -> Described:
    watch = lambda done: report("kills", f"{done} of {amounts.kills}")
    result = kills.kill_campaigns(amounts.kills, seed, folder, until=until, watch=watch)
    return _plain(result._asdict()) | {"asked": amounts.kills}, result.failures, []


def _hours(run: Run, amounts: Amounts, seed: int, folder: Path, until: float, report: Watch) -> Described:
    watch = lambda done: report("hours", f"{done:g} of {amounts.hours:g}")
    result = hours_soak.simulate_hours(amounts.hours, seed, until, watch)
    return _plain(result._asdict()) | {"asked": amounts.hours}, result.failures, []


def _faults(run: Run, amounts: Amounts, seed: int, folder: Path, until: float, report: Watch) -> Described:
    watch = _seldom(lambda done, failed: report("faults", f"{done} of {amounts.faults}, {failed} failed"))
    result = faults_soak.run_faulted(amounts.faults, seed, until, watch)
    return _plain(result._asdict()) | {"asked": amounts.faults}, result.failures, []


def _controls(run: Run, amounts: Amounts, seed: int, folder: Path, until: float, report: Watch) -> Described:
    watch = lambda done: report("controls", f"{done} done")
    result = controls.run_controls(amounts.short_controls, until, watch)
    return _plain(result._asdict()), result.failures, []


def _links(run: Run, amounts: Amounts, seed: int, folder: Path, until: float, report: Watch) -> Described:
    words = lambda done: ", ".join(f"{link} {count}" for link, count in done.items())
    report_counts = _seldom(lambda done, total: report("links", f"{words(done)} of {total}"))

    def watch(done: Mapping[str, int], failures: Sequence[Failure]) -> None:
        report_counts(done, amounts.links)
        for failure in failures:
            report("links", f"{failure.event} {failure.identity}: {failure.says}")

    result = links_soak.attack_links(run, amounts.links, seed, folder, until=until, watch=watch)
    return _plain(result._asdict()) | {"asked": amounts.links}, result.failures, []


_PARTS: Mapping[str, Callable[..., Described]] = {
    "inputs": _inputs,
    "kills": _kills,
    "hours": _hours,
    "faults": _faults,
    "controls": _controls,
    "links": _links,
}


def _plain(results: dict[str, Any]) -> dict[str, Any]:
    return {key: value for key, value in results.items() if key != "failures"}


def _seldom(watch: Callable[[Any, int], None]) -> Callable[[Any, int], None]:
    """Call a function once a second at most."""
    last = [0.0]

    def called(done: Any, failed: int) -> None:
        if time.monotonic() - last[0] > 1.0:
            last[0] = time.monotonic()
            watch(done, failed)

    return called
