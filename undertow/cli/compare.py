"""`undertow compare`: compare controllers on one scenario, or several scenarios, trial by trial."""

import re
import shutil
from collections.abc import Sequence
from pathlib import Path

from rich.console import Console

from undertow.campaign.build_trials import build_trial
from undertow.campaign.run_campaign import STORE
from undertow.campaign.store_results import load
from undertow.cli.exit_codes import DONE, RUN_FAILED, warn_of
from undertow.cli.pdf_option import check_pdf
from undertow.cli.replay_option import check_replay, run_again
from undertow.cli.stages import stage
from undertow.cli.tables import numbers, titled, wide_console
from undertow.cli.trials import built_with_advice, resumable, run_trials, trial_text, trials_folder, worker_count
from undertow.comparison.comparison import Comparison, read_comparison
from undertow.comparison.prepare import PreparedComparison, prepare_comparison
from undertow.comparison.sentences import sentences
from undertow.comparison.tables import NOTE, medians
from undertow.core import checks
from undertow.core.status import Status
from undertow.report.comparison_page import write_comparison
from undertow.scenario.finished_run import to_json
from undertow.scenario.part_cache import PartCache

# File of each style of table.
_TABLES = {"markdown": "comparison.md", "latex": "comparison.tex", "csv": "comparison.csv"}
_WRITTEN = (STORE, "comparison.html", "comparison.json", *_TABLES.values(), "figures", "scenarios")


def compare(
    paths: Sequence[Path],
    entries: str | None,
    trials: int | None,
    out: Path | None,
    resume: bool,
    workers: int | None,
    overwrite: bool,
    allow_code: bool,
    pdf: str | None,
    replay: bool,
) -> int:
    """Run a comparison and write the results to `out`, or to a free folder under runs/; return the exit code."""
    check_pdf(pdf)
    count = worker_count(workers)
    if trials is not None:
        checks.positive("--trials", trials)
    several = None if entries is None else [one for one in map(str.strip, entries.split(",")) if one]
    again = ["compare", *map(str, paths), *(["--controllers", entries] if entries else [])]
    again += ["--trials", str(trials)] if trials is not None else []
    again += ["--replay"] if replay else []
    with trials_folder(out, f"{paths[0].stem}-comparison", _WRITTEN, resume, overwrite) as folder:
        console = wide_console()
        ready = built_with_advice(console, lambda: prepare_comparison(paths, several, trials, allow_code))
        if replay:
            check_replay(ready.built)
        with resumable(folder, again):
            run_trials(console, ready.prepared, folder, None if resume else _WRITTEN, None, count)
            return _conclude(console, ready, folder, pdf, replay)


def _conclude(console: Console, ready: PreparedComparison, folder: Path, pdf: str | None, replay: bool) -> int:
    """Write page, tables and scenarios; print the findings."""
    firsts = dict(zip(ready.names, ready.built, strict=True)) if replay else {}
    replays, missing = run_again(console, firsts)
    with stage(console, "statistics and page"):
        results = load(folder)
        comparison = read_comparison(folder, results, ready)
        found = comparison.findings
        files = _write_scenarios(ready, comparison, folder / "scenarios")
        for style, name in _TABLES.items():
            (folder / name).write_text(comparison.table(style), encoding="utf-8")
        (folder / "comparison.json").write_text(to_json(found.data(), indent=1) + "\n", encoding="utf-8")
        page, failures = write_comparison(comparison, results, ready.subject, folder, pdf, replays)
    warn_of([*missing, *failures])
    rows = medians(found)
    table = titled(f"Median of {found.trials} trials", rows.head[0], *map(numbers, rows.head[1:]))
    for row in rows.rows:
        table.add_row(*row)
    console.print(table)
    for sentence in (NOTE, *sentences(found)):
        console.print(sentence, markup=False, highlight=False, soft_wrap=True)
    for name, note in found.tuning.items():
        console.print(f"{name}: {note}.", markup=False, highlight=False, soft_wrap=True)
    for name, note in zip(ready.names, ready.notes, strict=True):
        if not note.tuned and name in files:
            said = f"To tune {name}: undertow tune {files[name]}; then compare its tuned.yaml"
            console.print(said, markup=False, highlight=False, soft_wrap=True)
    console.print(f"Page: {page}", highlight=False, soft_wrap=True)
    return DONE if all(found.completed(name) == found.trials for name in found.names) else RUN_FAILED


def _write_scenarios(ready: PreparedComparison, comparison: Comparison, folder: Path) -> dict[str, Path]:
    """Write the scenario of the first trial of each candidate, and of its first failed one; the former by name.

    `undertow simulate` repeats such a trial; `undertow tune` tunes its controller.
    """
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir()
    files, part_cache = {}, PartCache()
    for i, (name, first) in enumerate(zip(ready.names, ready.built, strict=True)):
        file = folder / f"{i + 1}-{re.sub(r'[^a-zA-Z0-9_-]+', '-', name).strip('-')}.yaml"
        files[name] = file
        file.write_text(
            trial_text(first, f"{name}, in one trial: {comparison.findings.tuning[name]}."), encoding="utf-8"
        )
        rows = comparison.dataset.isel({ready.dimension: i})
        for trial in rows["trial"].values[rows["status"].values > int(Status.OK)][:1].tolist():
            text = trial_text(
                build_trial(ready.prepared.trials, part_cache, trial), f"{name}, trial {trial}: it failed."
            )
            file.with_stem(f"{file.stem}-failed").write_text(text, encoding="utf-8")
    return files
