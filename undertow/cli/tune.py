"""`undertow tune`: tune the gains of a controller, with a certificate and an evaluation on held-out runs."""

import contextlib
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

from rich.console import Console
from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn
from rich.table import Table

from undertow.cli.exit_codes import DONE, warn_of
from undertow.cli.interruptible import interruptible
from undertow.cli.options.tune import TuneCommand
from undertow.cli.pdf_option import check_pdf
from undertow.cli.results_folder import output_folder, results_folder
from undertow.cli.tables import numbers, titled, wide_console
from undertow.cli.unfinished import checkpoint_in, unfinished
from undertow.core import checks
from undertow.core.json_text import to_json
from undertow.report.figures import save_all
from undertow.report.figures.tuning import tuning_figure
from undertow.scenario.reading import read
from undertow.studies.tuning.cost import times_other
from undertow.studies.tuning.objective import Improvement
from undertow.studies.tuning.tune import METHODS, Tuned, as_data, as_scenario, tune

_WRITTEN = ("tuned.yaml", "tuning.json", "figures")
_CHECKPOINT = "tuning.jsonl"


def tune_scenario(command: TuneCommand) -> int:
    """Tune a scenario and write the results to `out`, or to a free folder under runs/; return the exit code."""
    method, budget, resume = command.method, command.budget, command.resume
    check_pdf(command.pdf)
    checks.choice("--method", method, METHODS)
    checks.positive("--budget", budget, "s")
    console = wide_console()
    first = Path("runs") / f"{command.scenario.stem}-tuned"
    text = read(command.scenario, allow_code=command.allow_code)
    out = unfinished(first, _CHECKPOINT) if resume and command.out is None else command.out
    with (
        output_folder(out, first) as folder,
        results_folder(folder, _WRITTEN, "tuning.json", command.overwrite) as draft,
        checkpoint_in(folder, _CHECKPOINT, "tune") as checkpoint,
    ):
        with _live(console, budget) as (say, watch):
            options: dict[str, Any] = {"method": method, "budget": budget, "started": command.since, "resume": resume}
            tuning = interruptible(lambda: tune(text, checkpoint, **options, say=say, watch=watch))
        data = as_data(tuning)
        (draft.path / "tuned.yaml").write_text(as_scenario(tuning), encoding="utf-8")
        (draft.path / "tuning.json").write_text(to_json(data, indent=2) + "\n", encoding="utf-8")
        draft.publish()  # before the figure, which may fail
        checkpoint.unlink()
        warn_of(save_all(lambda: {"tuning": lambda: tuning_figure(data)}, draft.path / "figures", command.pdf).failures)
    console.print(_table(tuning))
    for line in _sentences(tuning):
        console.print(line, highlight=False, soft_wrap=True)
    console.print(f"Results: {folder}", highlight=False, soft_wrap=True)
    return DONE


@contextlib.contextmanager
def _live(
    console: Console, budget: float
) -> Iterator[tuple[Callable[[str], None], Callable[[Improvement, int], None]]]:
    """Show the current stage, the best cost so far and the remaining budget."""
    columns = (TextColumn("{task.description}"), BarColumn(), TextColumn("{task.fields[left]}"), TimeElapsedColumn())
    with Progress(*columns, console=console, transient=True, disable=not console.is_terminal) as live:
        task = live.add_task("reading", total=budget, left="")

        def say(stage: str) -> None:
            live.update(task, description=stage)
            if not console.is_terminal:
                console.print(stage, highlight=False)

        def watch(best: Improvement, evaluations: int) -> None:
            remaining = max(0.0, budget - best.elapsed)
            line = f"{evaluations} evaluations, best cost {best.cost:.4g}, spectral radius {best.radius:.5f}"
            live.update(task, description=line, completed=best.elapsed, left=f"{remaining:.0f} s left at most")
            if not console.is_terminal:
                console.print(line, highlight=False)

        yield say, watch


def _table(tuning: Tuned) -> Table:
    columns = ("training", "held out", "tracking", "effort", "variation", "failure", "spectral radius")
    table = titled("Cost, mean over runs", "gains", *map(numbers, columns))
    for gains in tuning.evaluated:
        parts = [f"{float(part.mean()):.4g}" for part in gains.held_out]
        table.add_row(
            gains.name,
            f"{gains.train_cost:.4g}",
            f"{gains.held_out_cost:.4g}",
            *parts,
            f"{gains.certificate.worst:.5f}",
        )
    return table


def _sentences(tuning: Tuned) -> list[str]:
    scenario_gains, *_, tuned = tuning.evaluated
    chosen_gains = tuning.kept
    options = ", ".join(f"{name} {_short(value)}" for name, value in (tuned.options or {}).items())
    ending = "the search has converged" if tuning.finished else "the time budget is used up"
    if tuning.searched == 0:
        ending += ", and only the initial design (the given gains and points spread over their ranges) was evaluated"
    if chosen_gains is scenario_gains:
        summary = (
            f"The given gains are kept: on held-out runs their cost is {scenario_gains.held_out_cost:.4g}, and "
            f"{tuned.held_out_cost:.4g} with the best that were found ({options})."
        )
    else:
        uncertified = "" if scenario_gains.certificate.holds else ", which have no certificate of stability"
        summary = (
            f"Tuned: {options}\n"
            f"The held-out cost is {times_other(tuned.held_out_cost, scenario_gains.held_out_cost)} with the given "
            f"gains{uncertified}."
        )
    spent = (
        f"{tuning.evaluations} evaluations, {tuning.rejected} rejected without a certificate, {tuning.elapsed:.0f} s"
    )
    return [f"{summary} {spent}; {ending}."]


def _short(value: Any) -> str:
    """Gains as text; equal gains of several axes are shown once."""
    if not isinstance(value, list):
        return f"{value:g}"
    rows = [_short(entry) if isinstance(entry, list) else f"{entry:g}" for entry in value]
    return rows[0] if len(set(rows)) == 1 else f"({', '.join(rows)})"
