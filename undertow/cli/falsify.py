"""`undertow falsify`: find the smallest departure from a scenario that breaks a requirement."""

import contextlib
from collections.abc import Callable, Iterator
from pathlib import Path

from rich.console import Console
from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn
from rich.table import Table

from undertow.cli.exit_codes import DONE, warn_of
from undertow.cli.interruptible import interruptible
from undertow.cli.options.falsify import FalsifyCommand
from undertow.cli.pdf_option import check_pdf
from undertow.cli.results_folder import output_folder, results_folder
from undertow.cli.tables import numbers, print_lines, titled, wide_console
from undertow.cli.trials import trial_text
from undertow.cli.unfinished import checkpoint_in, unfinished
from undertow.core import checks
from undertow.core.errors import BadInput
from undertow.core.json_text import to_json
from undertow.report.answers.falsification_answer import answer_of_falsification, violated
from undertow.report.figures import save_all
from undertow.report.figures.falsification import beside_nominal_figure, search_figure
from undertow.scenario.reading import read
from undertow.studies.falsification.falsify import METHODS, Falsified, as_data, falsify
from undertow.studies.falsification.objective import Violation

_WRITTEN = ("falsify.json", "counterexample.yaml", "figures")
_CHECKPOINT = "falsify.jsonl"


def falsify_scenario(command: FalsifyCommand) -> int:
    """Falsify a scenario and write the results to `out`, or to a free folder under runs/; return the exit code."""
    scenario, resume = command.scenario, command.resume
    method, budget, seed = command.method, command.budget, command.seed
    check_pdf(command.pdf)
    checks.choice("--method", method, METHODS)
    if budget < 1:
        raise BadInput("--budget", "be at least 1 run", budget)
    if not 0 <= seed < 2**32:
        raise BadInput("--seed", "be between 0 and 2^32 - 1", seed)
    console = wide_console()
    first = Path("runs") / f"{scenario.stem}-falsified"
    text = read(scenario, allow_code=command.allow_code)
    out = unfinished(first, _CHECKPOINT) if resume and command.out is None else command.out
    with (
        output_folder(out, first) as folder,
        results_folder(folder, _WRITTEN, "falsify.json", command.overwrite) as draft,
        checkpoint_in(folder, _CHECKPOINT, "falsify") as checkpoint,
    ):
        with _live(console, budget) as (say, watch):
            options = {"budget": budget, "seed": seed, "method": method, "checkpoint": checkpoint, "resume": resume}
            falsification = interruptible(lambda: falsify(text, **options, say=say, watch=watch))
        data = as_data(falsification)
        (draft.path / "falsify.json").write_text(to_json(data, indent=2) + "\n", encoding="utf-8")
        if falsification.violation is not None:
            sentence = f"Counter-example of {scenario.name}: {violated(falsification)}."
            scenario_text = trial_text(falsification.single_runs[-1].built, sentence)
            (draft.path / "counterexample.yaml").write_text(scenario_text, encoding="utf-8")
        draft.publish()  # before the figures, which may fail
        checkpoint.unlink()
        plots = {"search": lambda: search_figure(data)}
        if falsification.violation is not None:
            nominal, broken = (run.dataset for run in falsification.single_runs)
            plots["counterexample"] = lambda: beside_nominal_figure(nominal, broken)
        warn_of(save_all(lambda: plots, draft.path / "figures", command.pdf).failures)
    if falsification.violation is not None and command.details:
        console.print(_table(falsification))
    print_lines(console, [*answer_of_falsification(falsification, folder).text, f"Results: {folder}"])
    return DONE


@contextlib.contextmanager
def _live(
    console: Console, budget: int
) -> Iterator[tuple[Callable[[str], None], Callable[[int, float, Violation | None], None]]]:
    """Show the current stage, the number of runs and the best so far."""
    columns = (TextColumn("{task.description}"), BarColumn(), TextColumn("{task.fields[best]}"), TimeElapsedColumn())
    with Progress(*columns, console=console, transient=True, disable=not console.is_terminal) as live:
        task = live.add_task("reading", total=budget, best="")

        def say(stage: str) -> None:
            live.update(task, description=stage)
            if not console.is_terminal:
                console.print(stage, highlight=False)

        def watch(runs: int, least: float, smallest: Violation | None) -> None:
            size = "" if smallest is None else f", smallest violation {smallest.size:.4g}"
            live.update(task, completed=runs, best=f"{runs} runs, least robustness {least:.3g}{size}")

        yield say, watch


def _table(falsification: Falsified) -> Table:
    assert falsification.violation is not None
    table = titled("Counter-example", "key", *map(numbers, ("low", "nominal", "value", "high", "departure")))
    for axis, away in zip(falsification.box.axes, falsification.violation.departure.tolist(), strict=True):
        row = (axis.low, axis.nominal, falsification.values()[axis.key], axis.high)
        table.add_row(axis.key, *(f"{value:.5g}" for value in row), f"{100 * away:.3g} %")
    return table
