"""Trials of a campaign or a comparison in a results folder: checked, run with progress, and resumed after a stop."""

import contextlib
import os
import shlex
import time
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Protocol, TypeVar

import typer
from rich.console import Console

from undertow.cli import results_folder
from undertow.cli.interruptible import interruptible
from undertow.cli.results_folder import output_folder
from undertow.cli.stages import shares, stage
from undertow.core import checks
from undertow.core.errors import BadInput
from undertow.core.file_lock import file_lock
from undertow.scenario.build import Built
from undertow.scenario.reading import dump
from undertow.simulation.executors import make_executor
from undertow.studies.campaign.prepare import Prepared
from undertow.studies.campaign.run_campaign import STORE, Tally, Watch, run_campaign
from undertow.studies.campaign.store_results import load


class _Advised(Protocol):
    @property
    def advice(self) -> Sequence[str]: ...


T = TypeVar("T", bound=_Advised)


def worker_count(workers: int | None) -> int:
    """Number of worker processes: as given, or one for each processor core.

    Raises:
        BadInput: it is not positive.
    """
    count = os.cpu_count() or 1 if workers is None else workers
    checks.positive("--workers", count)
    return count


@contextlib.contextmanager
def trials_folder(
    out: Path | None, name: str, written: Sequence[str], resume: bool, overwrite: bool, before: str = STORE
) -> Iterator[Path]:
    """The folder of a campaign, locked while it runs: `out`, or a free folder of that name under runs/.

    Args:
        out: the folder given by the user.
        name: without it; where a campaign is resumed, exactly this one.
        written: the files and folders that the command writes.
        resume: whether the campaign in the folder is continued.
        overwrite: whether it is replaced.
        before: what the command writes before the trials, from which it is resumed too.

    Raises:
        BadInput: the folder cannot be used.
    """
    first = Path("runs") / name
    with output_folder(out or (first if resume else None), first) as folder:
        if resume and overwrite:
            hint = "--resume continues the campaign, --overwrite replaces it"
            raise BadInput("--resume", "be without --overwrite", "given together with it", hint=hint)
        if not resume:
            hint = "Add --resume to continue it, or --overwrite to replace it"
            marker = STORE if (folder / STORE).exists() else before
            results_folder.check_folder(folder, written, marker, overwrite, hint)
        elif not any((folder / entry).exists() for entry in (STORE, before)):
            hint = "Leave --resume out to start one"
            raise BadInput("--resume", "find a campaign to continue", f"none in {folder}", hint=hint)
        yield folder


def built_with_advice(console: Console, build: Callable[[], T]) -> T:
    """Build the first trials and print the advice on them."""
    with stage(console, "building first trials"):
        built = interruptible(build)
    for sentence in built.advice:
        typer.echo(f"Advice: {sentence}", err=True)
    return built


@contextlib.contextmanager
def resumable(folder: Path, command: Sequence[str]) -> Iterator[None]:
    """Where what is inside is stopped, print how many trials are kept, and the command that continues.

    Args:
        folder: that of the results.
        command: words after `undertow` of the command to repeat, without `--out` and `--resume`.
    """
    try:
        yield
    except (KeyboardInterrupt, OSError):
        if (folder / STORE).is_dir():
            resume_command = shlex.join(["undertow", *command, "--out", str(folder), "--resume"])
            typer.echo(f"Stopped{_kept(folder)}. To continue: {resume_command}", err=True)
        raise


def _kept(folder: Path) -> str:
    """How many trials are in a folder; "" where a damaged store does not tell."""
    try:
        results = load(folder)
    except (OSError, BadInput):
        return ""
    return f": {results.rows.sizes['trial']} of {results.total} trials are in {folder}"


def run_trials(
    console: Console, prepared: Prepared, folder: Path, replaced: Sequence[str] | None, where: str | None, workers: int
) -> None:
    """Run all trials that are not in the folder yet.

    Args:
        console: for the progress.
        prepared: the campaign.
        folder: that of the results.
        replaced: files and folders of an earlier campaign there, to be removed first; None to continue it.
        where: cluster, or None for this machine.
        workers: number of threads, or of worker processes of the cluster.
    """
    if replaced is not None:
        _clear(folder, replaced)
    with make_executor(where, workers) as executor, _live(console, replaced is None) as watch:
        threads = workers if where is None else None
        interruptible(lambda: run_campaign(prepared, folder, executor, watch, threads))


def _clear(folder: Path, names: Sequence[str]) -> None:
    """Remove all files of a campaign that is replaced, by their names.

    Raises:
        BadInput: another process is running it.
    """
    if not folder.exists():
        return
    with file_lock(folder / STORE):
        for name in names:
            results_folder.remove(folder / name)


@contextlib.contextmanager
def _live(console: Console, resumed: bool) -> Iterator[Watch]:
    """Show the number of finished trials, their rate and the remaining time; first, where resumed, what is kept."""
    start_time, first = time.perf_counter(), None
    with shares(console, remaining=True) as progress:

        def watch(tally: Tally) -> None:
            nonlocal first
            if first is None and resumed:
                remark = "" if tally.done == tally.trials else "; chunks that were not finished run again"
                message = f"continuing: {tally.done} of {tally.trials} trials kept{remark}"
                console.print(message, highlight=False)
            first = tally.done if first is None else first
            rate = (tally.done - first) / max(time.perf_counter() - start_time, 1e-9)
            invalid = f", {tally.invalid} invalid" if tally.invalid else ""
            waiting = "compiling" if tally.done < tally.trials else "all trials are done"
            text = f"{rate:.3g} per second, {tally.failed} failed{invalid}" if tally.done > first else waiting
            progress(f"{tally.done} of {tally.trials} trials, {text}", tally.done / tally.trials)

        yield watch


def trial_text(built: Built, sentence: str) -> str:
    """The scenario of a trial, which `undertow simulate` repeats, with a sentence above it."""
    data = built.resolved | {"steady": built.resolved["steady"] | {"every_step": True}}  # with contents of named files
    return f"# {sentence}\n{dump(data)}"
