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
from undertow.cli.tables import numbers, print_lines, titled, wide_console
from undertow.cli.unfinished import checkpoint_in, unfinished
from undertow.core import checks
from undertow.core.json_text import to_json
from undertow.report.answers.tuning_answer import answer_of_tuning
from undertow.report.figures import save_all
from undertow.report.figures.tuning import tuning_figure
from undertow.scenario.reading import read
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
    if command.details:
        console.print(_table(tuning))
    print_lines(console, [*answer_of_tuning(tuning, folder).text, f"Results: {folder}"])
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
        held_out = gains.held_out
        parts_of_cost = (held_out.tracking, held_out.effort, held_out.variation, held_out.lost)
        parts = [f"{float(part.mean()):.4g}" for part in parts_of_cost]
        table.add_row(
            gains.name,
            f"{gains.train_cost:.4g}",
            f"{gains.held_out_cost:.4g}",
            *parts,
            f"{gains.certificate.worst:.5f}",
        )
    return table
