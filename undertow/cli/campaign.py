"""`undertow campaign`: run a Monte Carlo study or a parameter sweep, and summarise it."""

import contextlib
import os
import shutil
import time
from collections.abc import Iterator, Sequence
from functools import partial
from pathlib import Path
from typing import NoReturn

import typer
from rich.console import Console

from undertow.campaign.campaign_summary import endings, summary
from undertow.campaign.clusters import check_cluster, cluster
from undertow.campaign.executors import by_dask, in_threads
from undertow.campaign.prepare import Prepared, prepare
from undertow.campaign.run_campaign import STORE, Executor, Tally, Watch, run_campaign
from undertow.campaign.store_results import load
from undertow.campaign.task import build_trial
from undertow.cli.campaign_folder import check_folder, clear_folder
from undertow.cli.campaign_text import sentences, table
from undertow.cli.exit_codes import DONE, RUN_FAILED, warn_of
from undertow.cli.interruptible import interruptible
from undertow.cli.results_folder import output_folder
from undertow.cli.stages import Stages, shares
from undertow.cli.tables import wide_console
from undertow.core import checks
from undertow.core.errors import BadInput
from undertow.report.campaign_page import write_campaign
from undertow.scenario.part_cache import PartCache
from undertow.scenario.reading import dump
from undertow.scenario.results import to_json


def campaign(
    path: Path,
    out: Path | None,
    resume: bool,
    workers: int | None,
    where: str | None,
    overwrite: bool,
    allow_code: bool,
) -> int:
    """Run a campaign and write the results to `out`, or to a free folder under runs/; return the exit code."""
    count = os.cpu_count() or 1 if workers is None else workers
    checks.positive("--workers", count)
    if where is not None:
        check_cluster(where)
    first = Path("runs") / path.stem
    with output_folder(out or (first if resume else None), first) as folder:
        check_folder(folder, resume, overwrite)
        console = wide_console()
        stages = Stages(console)
        with stages("building first trials"):
            prepared = interruptible(lambda: prepare(path, allow_code))
        for sentence in prepared.advice:
            typer.echo(f"Advice: {sentence}", err=True)
        if not resume:
            clear_folder(folder)
        with _executor(where, count) as executor, _live(console) as watch:
            try:
                interruptible(lambda: run_campaign(prepared, folder, executor, watch))
            except (KeyboardInterrupt, OSError):
                if (folder / STORE).is_dir():
                    typer.echo(f"Stopped. To resume: undertow campaign {path} --out {folder} --resume", err=True)
                raise
        return _conclude(console, stages, prepared, folder)


def _conclude(console: Console, stages: Stages, prepared: Prepared, folder: Path) -> int:
    """Write page, summary and the scenarios of the worst trials; print the summary."""
    with stages("summary and page"):
        results = load(folder)
        found = summary(results, prepared.trials)
        (folder / "summary.json").write_text(to_json(found, indent=1) + "\n", encoding="utf-8")
        _write_worst(prepared, found["worst"], folder / "worst")
        title = prepared.trials.campaign.description or f"Campaign {prepared.trials.text.name}"
        page, failures = write_campaign(title, results, found, folder)
    warn_of(failures)
    console.print(table(results, found))
    for sentence in sentences(found):
        console.print(sentence, markup=False, highlight=False, soft_wrap=True)
    console.print(f"Page: {page}", highlight=False, soft_wrap=True)
    return DONE if set(found["status"]) <= {"completed"} else RUN_FAILED


def refuse_second(argument: Path) -> NoReturn:
    """Reject a second argument, which only `status` takes."""
    raise BadInput(
        "DIR", "follow the word `status`", str(argument), hint=f"To choose the results folder, use `--out {argument}`"
    )


def status(folder: Path, options: Sequence[str]) -> int:
    """Print the progress of the campaign in a folder.

    Args:
        folder: the folder of the campaign.
        options: options given by mistake; `status` takes none.
    """
    if options:
        raise BadInput(options[0], "be left out with `status`", "given", hint="Run: undertow campaign status DIR")
    try:
        results = load(folder)
    except FileNotFoundError:
        raise BadInput("DIR", "be the folder of a campaign", str(folder)) from None
    ended = endings(results.rows)
    console = wide_console()
    console.print(f"{results.rows.sizes['trial']} of {results.total} trials done", highlight=False)
    for word, number in ended.items():
        console.print(f"  {word}: {number}", highlight=False)
    return DONE


@contextlib.contextmanager
def _executor(where: str | None, count: int) -> Iterator[Executor]:
    if where is None:
        yield partial(in_threads, threads=count)
        return
    with cluster(where, count) as client:
        yield partial(by_dask, client=client)


@contextlib.contextmanager
def _live(console: Console) -> Iterator[Watch]:
    """Show the number of finished trials, their rate and the remaining time."""
    begun, first = time.perf_counter(), None
    with shares(console, remaining=True) as progress:

        def watch(tally: Tally) -> None:
            nonlocal first
            first = tally.done if first is None else first
            rate = (tally.done - first) / max(time.perf_counter() - begun, 1e-9)
            invalid = f", {tally.invalid} invalid" if tally.invalid else ""
            waiting = "compiling" if tally.done < tally.trials else "all trials are done"
            text = f"{rate:.3g} per second, {tally.failed} failed{invalid}" if tally.done > first else waiting
            progress(f"{tally.done} of {tally.trials} trials, {text}", tally.done / tally.trials)

        yield watch


def _write_worst(prepared: Prepared, trials: list[int], folder: Path) -> None:
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir()
    part_cache = PartCache()
    for trial in trials:
        data = build_trial(prepared.trials, part_cache, trial).resolved  # includes the contents of named files
        data = data | {"steady": data["steady"] | {"every_step": True}}
        text = f"# Trial {trial} of the campaign.\n{dump(data)}"
        (folder / f"trial-{trial:07d}.yaml").write_text(text, encoding="utf-8")
