"""`python -m soak`: attack undertow itself, count, and report."""

import json
import sys
import time
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from soak import soak as soaking
from soak.input_runner import write_files
from soak.inputs import BUILD
from soak.kept_commands import kept
from soak.options import SoakCommand
from soak.page import soak_page
from undertow.cli import exit_codes
from undertow.cli.interruptible import interruptible
from undertow.cli.main import run
from undertow.cli.results_folder import output_folder, results_folder
from undertow.core.checks import not_negative
from undertow.core.errors import BadInput
from undertow.scenario.build import build
from undertow.scenario.reading import read

_WRITTEN = ("soak.json", "soak.html", "failures")
_SHOWN = 20  # failures that are printed


def soak(command: SoakCommand) -> int:
    """Attack undertow itself; the exit code is 1 if there was a never-event."""
    if command.replay is not None:
        return _replayed(command.replay)
    amounts = soaking.SHORT if command.short else soaking.Amounts()
    parts = command.parts or []
    for name in ("inputs", "kills", "hours", "faults", "links"):
        value = getattr(command, name)
        if value is not None:
            amounts = amounts._replace(**{name: _count(name, value)})
    nonempty_parts = [part for part in soaking.check_parts(parts) if getattr(amounts, part, 1)]
    if not nonempty_parts:
        raise BadInput("PART", "be a part of which there is more than nothing", ", ".join(parts) or None)
    seed = int(time.time()) if command.seed is None else command.seed
    limit = float("inf") if command.minutes is None else _count("minutes", command.minutes)
    return _soak(nonempty_parts, amounts, seed, limit, command.out, command.overwrite)


def attacked(arguments: Sequence[str]) -> int:
    """Run `undertow` with arguments in this process, or build a scenario, with the guard of the command line."""
    return exit_codes.run_guarded(_Build(), arguments) if arguments[:1] == (BUILD,) else run(arguments)


class _Build:
    """A command that reads, validates and builds a scenario."""

    def main(self, args: Sequence[str], **settings: Any) -> int:
        """Build the scenario that is the second word."""
        build(read(Path(args[1])))
        return exit_codes.DONE


def _soak(parts: Sequence[str], amounts: Any, seed: int, minutes: float, out: Path | None, overwrite: bool) -> int:
    print(f"Seed {seed}; parts: {', '.join(parts)}", file=sys.stderr)
    progress = lambda part, words: print(f"{part}: {words}", file=sys.stderr, flush=True)
    with (
        output_folder(out, Path("runs") / "soak") as folder,
        results_folder(folder, _WRITTEN, "soak.json", overwrite) as draft,
    ):
        result = interruptible(lambda: soaking.soak(attacked, parts, amounts, seed, minutes, progress, kept))
        (draft.path / "soak.json").write_text(json.dumps(result.summary, indent=1) + "\n", encoding="utf-8")
        (draft.path / "soak.html").write_text(soak_page(result.summary), encoding="utf-8")
        for failure, hostile_input in result.attacks:
            _keep(draft.path / "failures" / hostile_input.identity.replace("/", "-"), failure.says, hostile_input)
    _print(result.summary, folder)
    return exit_codes.DONE if result.passed else exit_codes.RUN_FAILED


def _keep(folder: Path, message: str, hostile_input: Any) -> None:
    """The files of a hostile input, and command.txt with its command line and what happened."""
    write_files(hostile_input.files, folder)
    folder.mkdir(parents=True, exist_ok=True)
    words = json.dumps(list(hostile_input.arguments))
    (folder / "command.txt").write_text(
        f"{hostile_input.identity}\n{words}\n{message}\n", encoding="utf-8", errors="replace"
    )


def _print(summary: dict[str, Any], folder: Path) -> None:
    for event, count in summary["events"].items():
        print(f"{event:<8}{count:>6}  {summary['meanings'][event]}")
    for failure in summary["failures"][:_SHOWN]:
        print(exit_codes.printable(f"{failure['event']} {failure['identity']}: {failure['says']}"))
    if len(summary["failures"]) > _SHOWN:
        print(f"{len(summary['failures']) - _SHOWN} more are in soak.json")
    print(f"Seed {summary['seed']}, {summary['seconds']:g} s. Page: {folder / 'soak.html'}")


def _replayed(what: str) -> int:
    """Repeat the failures of a soak.json, or one of an identity; the exit code is 1 if one occurs again."""
    file = Path(what).suffix == ".json"
    failed = False
    for identity in soaking.identities(Path(what)) if file else [what]:
        failure, words = soaking.replayed(attacked, identity, kept)
        verdict = f"{failure.event}, {failure.says}" if failure else "no never-event"
        print(exit_codes.printable(f"{identity}: {verdict}. {words}"))
        failed |= failure is not None
    return exit_codes.RUN_FAILED if failed else exit_codes.DONE


def _count(name: str, value: float) -> float:
    not_negative(f"--{name}", value)
    return value
