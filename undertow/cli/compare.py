"""`undertow compare`: compare controllers on one scenario, or several scenarios, trial by trial."""

import contextlib
import shlex
from collections.abc import Iterator, Sequence
from pathlib import Path

import typer
from rich.console import Console

from undertow.cli import results_folder
from undertow.cli.exit_codes import DONE, RUN_FAILED, warn_of
from undertow.cli.interruptible import interruptible
from undertow.cli.options.compare import CompareCommand
from undertow.cli.pdf_option import check_pdf
from undertow.cli.replay_option import check_replay, run_again
from undertow.cli.stages import new_lines, stage
from undertow.cli.tables import numbers, print_lines, titled, wide_console
from undertow.cli.trials import built_with_advice, resumable, run_trials, trial_text, trials_folder, worker_count
from undertow.core import checks
from undertow.core.atomic_io import replacing_folder, write_whole
from undertow.core.json_text import to_json
from undertow.core.status import Status
from undertow.report.answers.comparison_answer import answer_of_comparison
from undertow.report.comparison_page import noun_of, write_comparison
from undertow.scenario.part_cache import PartCache
from undertow.studies.campaign.build_trials import build_trial
from undertow.studies.campaign.run_campaign import STORE
from undertow.studies.campaign.store_results import load
from undertow.studies.comparison.budget_tables import budget_sentences
from undertow.studies.comparison.candidates import entries_of, file_stem
from undertow.studies.comparison.comparison import ComparisonResult, read_comparison
from undertow.studies.comparison.equal_budgets import FOLDER, check_budget, equal_budgets
from undertow.studies.comparison.findings import Findings
from undertow.studies.comparison.prepare import PreparedComparison, Tuner, prepare_comparison
from undertow.studies.comparison.sentences import sentences
from undertow.studies.comparison.step_time import HOW_LONG, step_times
from undertow.studies.comparison.tables import NOTE, medians
from undertow.studies.comparison.tables import table as table_of

# File of each style of table.
_TABLES = {"markdown": "comparison.md", "latex": "comparison.tex", "csv": "comparison.csv"}
_TIMES = "step_times.json"
_WRITTEN = (STORE, "comparison.html", "comparison.json", *_TABLES.values(), _TIMES, "figures", "scenarios")


def compare(command: CompareCommand) -> int:
    """Run a comparison and write the results to `out`, or to a free folder under runs/; return the exit code."""
    paths, entries, trials = command.scenarios, command.controllers, command.trials
    budget, resume, replay = command.tune, command.resume, command.replay
    check_pdf(command.pdf)
    if budget is not None:
        check_budget(budget)
    count = worker_count(command.workers)
    if trials is not None:
        checks.positive("--trials", trials)
    controllers = None if entries is None else entries_of(entries)
    resume_command = ["compare", *map(str, paths), *(["--controllers", entries] if entries else [])]
    resume_command += ["--trials", str(trials)] if trials is not None else []
    resume_command += ["--replay"] if replay else []
    resume_command += ["--tune", str(budget)] if budget is not None else []
    name = f"{paths[0].stem}-comparison"
    file_names = (*_WRITTEN, FOLDER)
    with trials_folder(command.out, name, file_names, resume, command.overwrite, FOLDER) as folder:
        console = wide_console()
        if not resume:
            results_folder.remove(folder / FOLDER)
        with _tuning(console, folder, budget, resume_command) as tuner:
            prepare = lambda: prepare_comparison(paths, controllers, trials, command.allow_code, tuner)
            ready = built_with_advice(console, prepare)
        if replay:
            check_replay(ready.built)
        with resumable(folder, resume_command):
            run_trials(console, ready.prepared, folder, None if resume else _WRITTEN, None, count)
            return _conclude(console, ready, folder, command)


@contextlib.contextmanager
def _tuning(
    console: Console, folder: Path, budget: int | None, resume_command: Sequence[str]
) -> Iterator[Tuner | None]:
    """What tunes the controllers, with its progress; None without a budget. Stopped, it says how to continue."""
    if budget is None:
        yield None
        return
    store, say = folder / FOLDER, new_lines(console)
    try:
        yield lambda candidates, scenario: equal_budgets(candidates, scenario, budget, store, say)
    except BaseException as error:
        if isinstance(error, KeyboardInterrupt) and store.is_dir() and any(store.iterdir()):
            line = shlex.join(["undertow", *resume_command, "--out", str(folder), "--resume"])
            typer.echo(f"Stopped while tuning; what was evaluated is kept. To continue: {line}", err=True)
        elif not (folder / STORE).exists():
            _remove_empty(store, folder)
        raise


def _remove_empty(*folders: Path) -> None:
    """Remove folders in which nothing was kept."""
    for folder in folders:
        with contextlib.suppress(OSError):
            folder.rmdir()


def _conclude(console: Console, ready: PreparedComparison, folder: Path, command: CompareCommand) -> int:
    """Write page, tables and scenarios; print the findings."""
    firsts = dict(zip(ready.names, ready.built, strict=True)) if command.replay else {}
    replays, missing = run_again(console, firsts)
    with stage(console, "time of a step"):
        times = interruptible(lambda: step_times(dict(zip(ready.names, ready.built, strict=True))))
    with stage(console, "statistics and page"):
        results = load(folder)
        comparison = read_comparison(folder, results, ready)
        findings = comparison.findings
        files = _write_scenarios(ready, comparison, folder / "scenarios")
        for style, name in _TABLES.items():
            write_whole(folder / name, table_of(findings, style))
        tuned = {} if ready.budgets is None else {"budgets": ready.budgets.data()}
        write_whole(folder / "comparison.json", to_json(findings.data() | tuned, indent=1) + "\n")
        # In a file of their own: they differ from run to run.
        step_time_data = {name: step_time._asdict() for name, step_time in times.items()}
        write_whole(folder / _TIMES, to_json(step_time_data, indent=1) + "\n")
        page, failures = write_comparison(
            comparison, results, ready.subject, folder, command.pdf, replays, times, ready.budgets
        )
    warn_of([*missing, *failures])
    rows = medians(findings, times)
    windows = {built.window() for built in ready.built}
    # Scenarios that are compared as a whole may differ in it.
    when = "".join(f", from {start:g} to {stop:g} s" for start, stop in windows) if len(windows) == 1 else ""
    table = titled(f"Median of {findings.trials} trials{when}", rows.head[0], *map(numbers, rows.head[1:]))
    for row in rows.rows:
        table.add_row(*row)
    console.print(table)
    if command.details:
        print_lines(console, _details(ready, findings, files))
    print_lines(console, [*answer_of_comparison(findings, noun_of(findings)).text, f"Page: {page}"])
    return DONE if all(findings.completed(name) == findings.trials for name in findings.names) else RUN_FAILED


def _details(ready: PreparedComparison, findings: Findings, files: dict[str, Path]) -> Iterator[str]:
    """What the statistics say of every two candidates, and how each was tuned."""
    yield from (NOTE, HOW_LONG, *sentences(findings))
    yield from () if ready.budgets is None else budget_sentences(ready.budgets)
    for name, note in findings.tuning.items():
        yield f"{name}: {note}."
    for name, note in zip(ready.names, ready.notes, strict=True):
        if not note.tuned and name in files and ready.budgets is None:
            yield f"To tune {name}: undertow tune {files[name]}; then compare its tuned.yaml"


def _write_scenarios(ready: PreparedComparison, comparison: ComparisonResult, folder: Path) -> dict[str, Path]:
    """Write the scenario of the first trial of each candidate, and of its first failed one; the former by name.

    `undertow simulate` repeats such a trial; `undertow tune` tunes its controller.
    """
    files, texts, part_cache = {}, {}, PartCache()
    for i, (name, first) in enumerate(zip(ready.names, ready.built, strict=True)):
        stem = file_stem(i, name)
        files[name] = folder / f"{stem}.yaml"
        texts[f"{stem}.yaml"] = trial_text(first, f"{name}, in one trial: {comparison.findings.tuning[name]}.")
        rows = comparison.dataset.isel({ready.dimension: i})
        for trial in rows["trial"].values[rows["status"].values > int(Status.OK)][:1].tolist():
            built = build_trial(ready.prepared.trials, part_cache, trial)
            texts[f"{stem}-failed.yaml"] = trial_text(built, f"{name}, trial {trial}: it failed.")
    with replacing_folder(folder) as new:
        for file, text in texts.items():
            (new / file).write_text(text, encoding="utf-8")
    return files
