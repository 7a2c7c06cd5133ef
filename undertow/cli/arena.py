"""`undertow arena`: run laws through the fixed tasks of the arena, and write the leader board."""

import shlex
from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

import typer
from rich.console import Console

from undertow.cli import results_folder
from undertow.cli.exit_codes import DONE, warn_of
from undertow.cli.interruptible import interruptible
from undertow.cli.options.arena import ArenaCommand
from undertow.cli.pdf_option import check_pdf
from undertow.cli.results_folder import output_folder
from undertow.cli.stages import new_lines, stage
from undertow.cli.tables import numbers, print_lines, titled, wide_console
from undertow.cli.trials import run_trials, worker_count
from undertow.core import checks
from undertow.core.atomic_io import write_whole
from undertow.core.errors import BadInput, did_you_mean
from undertow.core.json_text import to_json
from undertow.report.answers.arena_answer import answer_of_board
from undertow.report.arena_page import PAGE, SCORE, write_board
from undertow.scenario.reading import dump
from undertow.studies.arena.entry import ENTRY, LAWS, Cell, folder_of, prepare_entry, read_entry, with_law, write_entry
from undertow.studies.arena.leader_board import STEP, as_csv, as_markdown, board_of, leader_rows
from undertow.studies.arena.robustness import FOLDER, prepare_robustness
from undertow.studies.arena.tasks import CELLS, TASKS
from undertow.studies.arena.tuned_gains import TunedGains, tuned_gains
from undertow.studies.arena.vehicles import VEHICLES
from undertow.studies.campaign.prepare import Prepared
from undertow.studies.campaign.run_campaign import STORE
from undertow.studies.comparison.candidates import Candidate, laws
from undertow.studies.comparison.equal_budgets import check_budget
from undertow.studies.comparison.step_time import step_time

# All laws of undertow but for `nmpc`, which runs by XLA and takes hours.
EVERY = (
    "robust",
    "learning",
    "paper",
    "pid",
    "adrc",
    "indi",
    "lqi",
    "slotine_li",
    "mrac",
    "l1_adaptive",
    "adaptive_backstepping",
    "disturbance_observer",
    "super_twisting",
    "integral_sliding_mode",
    "neural",
    "placed",
    "ardusub",
    "px4",
)
_TUNING, _SCENARIOS = "tuning", "scenarios"
_WRITTEN = (PAGE, "leaderboard.json", "leaderboard.csv", "leaderboard.md", "figures")


class _Settings(NamedTuple):
    """What every law runs."""

    trials: int
    cells: tuple[Cell, ...]
    budget: int | None  # evaluations of gains for each vehicle
    robustness: bool
    workers: int
    overwrite: bool


def arena(command: ArenaCommand) -> int:
    """Run laws through the tasks, those that are missing in the folder, and write the leader board; the exit code."""
    entries = command.controllers or []
    trials = command.trials
    budget = command.tune
    tasks, vehicles, robustness = command.tasks, command.vehicles, command.robustness
    check_pdf(command.pdf)
    checks.positive("--trials", trials)
    if budget is not None:
        check_budget(budget)
    candidates = laws([word for entry in entries or EVERY for word in entry.split(",")])
    settings = _Settings(
        trials, _cells(tasks, vehicles), budget, robustness, worker_count(command.workers), command.overwrite
    )
    console = wide_console()
    with output_folder(command.out or Path("runs") / "arena", Path()) as folder:
        _check_place(folder)
        resume_command = ["arena", *entries, "--out", str(folder), "--trials", str(trials)]
        resume_command += ["--tune", str(budget)] if budget is not None else []
        resume_command += ["--robustness"] if robustness else []
        for option, value in (("--tasks", tasks), ("--vehicles", vehicles)):
            resume_command += [option, value] if value is not None else []
        try:
            for number, law in enumerate(candidates, 1):
                console.rule(f"{law.name} ({number} of {len(candidates)})", align="left")
                _run(console, law, folder_of(folder, law.name), settings)
        except (KeyboardInterrupt, OSError):
            typer.echo(
                f"Stopped; finished trials are kept. To continue: {shlex.join(['undertow', *resume_command])}", err=True
            )
            raise
        return _conclude(console, folder, command.pdf, command.details)


def _check_place(folder: Path) -> None:
    """Files of the names of results must be results."""
    existing = [name for name in (LAWS, *_WRITTEN) if (folder / name).exists()]
    if existing and not (folder / LAWS).is_dir():
        hint = f"Choose another folder, or move {existing[0]} out of this one"
        raise BadInput(
            "--out", "be a folder of an arena, or a free one", f"{folder}, which has {existing[0]}", hint=hint
        )


def _cells(tasks: str | None, vehicles: str | None) -> tuple[Cell, ...]:
    """Tasks and vehicles that were asked for."""
    selections = []
    for option, text, choices in (("--tasks", tasks, TASKS), ("--vehicles", vehicles, VEHICLES)):
        names = list(choices) if text is None else [word.strip() for word in text.split(",") if word.strip()]
        for name in names:
            if name not in choices:
                raise BadInput(
                    option, f"name {option.removeprefix('--')} of the arena", name, hint=did_you_mean(name, choices)
                )
        selections.append(names)
    cells = tuple((task, vehicle) for task, vehicle in CELLS if task in selections[0] and vehicle in selections[1])
    if not cells:
        hint = "`pitch_turn` is for bluerov2_heavy and odin, foreign models for bluerov2_heavy"
        raise BadInput("--tasks", "be tasks that one of the vehicles has", f"{tasks} with {vehicles}", hint=hint)
    return cells


def _run(console: Console, law: Candidate, folder: Path, settings: _Settings) -> None:
    """Tune and run one law, as far as its folder does not have that already."""
    if settings.overwrite:
        results_folder.remove(folder)
    folder.mkdir(parents=True, exist_ok=True)
    gains = None if settings.budget is None else _tuned(console, law, folder, settings.cells, settings.budget)
    with stage(console, "building"):
        entry, prepared = interruptible(lambda: prepare_entry(law, settings.trials, settings.cells, gains))
    if (folder / ENTRY).exists() and (stored_entry := read_entry(folder)) != entry:
        different = next(name for name in entry._fields if getattr(entry, name) != getattr(stored_entry, name))
        hint = "Give the law another name (NAME=ENTRY), choose another folder, or run it again with --overwrite"
        raise BadInput(law.name, "be the law that is in the folder", f"another: its {different} differ", hint=hint)
    for cell, why in entry.refused.items():
        typer.echo(f"Advice: {law.name} cannot run {cell[0]} on {cell[1]}, which counts as lost: {why}", err=True)
    _trials(console, prepared, folder, settings.workers)
    write_entry(entry, folder)
    _write_scenarios(law, folder / _SCENARIOS, settings.cells, gains)
    if not (folder / STEP).exists():
        with stage(console, "time of a step"):
            timing = interruptible(lambda: step_time(prepared.first))
            write_whole(folder / STEP, to_json(timing._asdict()) + "\n")
    if settings.robustness:
        with stage(console, "building robustness"):
            harder = interruptible(lambda: prepare_robustness(law, max(2, settings.trials // 4), gains))
        _trials(console, harder, folder / FOLDER, settings.workers)


def _tuned(console: Console, law: Candidate, folder: Path, cells: Sequence[Cell], budget: int) -> TunedGains:
    """Gains for every vehicle, tuned on a task of its own."""
    vehicles, say = list(dict.fromkeys(vehicle for _, vehicle in cells)), new_lines(console)
    return interruptible(lambda: tuned_gains(law, vehicles, budget, folder / _TUNING, say))


def _trials(console: Console, prepared: Prepared, folder: Path, workers: int) -> None:
    """Run the trials of a campaign that are missing."""
    folder.mkdir(exist_ok=True)
    run_trials(console, prepared, folder, None if (folder / STORE).exists() else (), None, workers)


def _write_scenarios(law: Candidate, folder: Path, cells: Sequence[Cell], gains: TunedGains | None) -> None:
    """Write the scenario of every task, which `undertow simulate` runs."""
    folder.mkdir(exist_ok=True)
    for cell in cells:
        for name, keys in with_law(cell, law, gains).items():
            header = f"# {law.name} in task {cell[0]} on {cell[1]}: {TASKS[cell[0]].question}.\n"
            write_whole(folder / f"{name.replace(' ', '-')}.yaml", header + dump(keys))


def _conclude(console: Console, folder: Path, pdf: str | None, details: bool) -> int:
    """Write page and tables of all laws in the folder, and print the board."""
    with stage(console, "scores and page"):
        board = board_of(folder)
        page, failures = write_board(board, folder, pdf)
        rows = leader_rows(board)
        write_whole(folder / "leaderboard.json", to_json(board.data(), indent=1) + "\n")
        write_whole(folder / "leaderboard.csv", as_csv(board))
        write_whole(folder / "leaderboard.md", as_markdown(rows))
    warn_of(failures)
    table = titled("Leader board", rows.head[0], *map(numbers, rows.head[1:]))
    for row in rows.rows:
        table.add_row(*row)
    console.print(table)
    explanation = [SCORE] if details else []
    print_lines(console, [*explanation, *answer_of_board(board).text, f"Page: {page}"])
    return DONE
