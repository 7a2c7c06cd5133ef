"""`undertow campaign`: run a Monte Carlo study or a parameter sweep, and summarise it."""

from pathlib import Path

from rich.console import Console
from rich.table import Table

from undertow.cli.exit_codes import DONE, RUN_FAILED, warn_of
from undertow.cli.options.campaign import CampaignCommand
from undertow.cli.pdf_option import check_pdf
from undertow.cli.replay_option import check_replay, run_again
from undertow.cli.stages import stage
from undertow.cli.tables import print_lines, titled, wide_console
from undertow.cli.trials import built_with_advice, resumable, run_trials, trial_text, trials_folder, worker_count
from undertow.core.atomic_io import replacing_folder, write_whole
from undertow.core.errors import BadInput
from undertow.core.json_text import to_json
from undertow.core.number_text import display_units
from undertow.report.answers.campaign_answer import answer_of_campaign
from undertow.report.campaign_page import write_campaign
from undertow.scenario.part_cache import PartCache
from undertow.simulation.executors import check_cluster
from undertow.studies.campaign.build_trials import build_trial
from undertow.studies.campaign.campaign_summary import endings, summary
from undertow.studies.campaign.prepare import Prepared, prepare
from undertow.studies.campaign.run_campaign import STORE
from undertow.studies.campaign.store_results import Results, load


def campaign(command: CampaignCommand) -> int:
    """Run a campaign and write the results to `out`, or to a free folder under runs/; return the exit code.

    With the word `status` in place of a campaign, print the progress of one.
    """
    if str(command.campaign) == "status":
        return _status(command)
    if command.folder is not None:
        hint = f"To choose the results folder, use `--out {command.folder}`"
        raise BadInput("DIR", "follow the word `status`", str(command.folder), hint=hint)
    path, resume, replay = command.campaign, command.resume, command.replay
    check_pdf(command.pdf)
    count = worker_count(command.workers)
    if command.cluster is not None:
        check_cluster(command.cluster)
    with trials_folder(command.out, path.stem, _WRITTEN, resume, command.overwrite) as folder:
        console = wide_console()
        prepared = built_with_advice(console, lambda: prepare(path, command.allow_code))
        if replay:
            check_replay([prepared.first])
        with resumable(folder, ["campaign", str(path), *(["--replay"] if replay else [])]):
            run_trials(console, prepared, folder, None if resume else _WRITTEN, command.cluster, count)
            return _conclude(console, prepared, folder, command)


def _conclude(console: Console, prepared: Prepared, folder: Path, command: CampaignCommand) -> int:
    """Write page, summary and the scenarios of the worst trials; print the summary."""
    with stage(console, "summary"):
        results = load(folder)
        summary_data = summary(results, prepared.trials)
    worst_trials = summary_data["worst"][:_REPLAYED] if command.replay else []
    part_cache = PartCache()
    worst = {f"trial {trial}": build_trial(prepared.trials, part_cache, trial) for trial in worst_trials}
    replays, missing = run_again(console, worst)
    with stage(console, "page"):
        write_whole(folder / "summary.json", to_json(summary_data, indent=1) + "\n")
        _write_worst(prepared, summary_data["worst"], folder / "worst")
        title = prepared.trials.campaign.description or f"Campaign {prepared.trials.text.name}"
        page, failures = write_campaign(title, results, summary_data, folder, command.pdf, replays)
    warn_of([*missing, *failures])
    if command.details:
        console.print(table(results, summary_data))
    print_lines(console, [*answer_of_campaign(results, summary_data).text, f"Page: {page}"])
    return DONE if set(summary_data["status"]) <= {"completed"} else RUN_FAILED


def _status(command: CampaignCommand) -> int:
    """Print the progress of the campaign in a folder."""
    folder = command.folder or Path()
    for name in _OF_RUNS:
        if getattr(command, name):
            option = f"--{name.replace('_', '-')}"
            raise BadInput(option, "be left out with `status`", "given", hint="Run: undertow campaign status DIR")
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


def _write_worst(prepared: Prepared, trials: list[int], folder: Path) -> None:
    part_cache = PartCache()
    with replacing_folder(folder) as new:
        for trial in trials:
            text = trial_text(build_trial(prepared.trials, part_cache, trial), f"Trial {trial} of the campaign.")
            (new / f"trial-{trial:07d}.yaml").write_text(text, encoding="utf-8")


_OF_RUNS = ("out", "resume", "workers", "cluster", "overwrite", "allow_code", "pdf", "replay")  # options
_REPLAYED = 3  # trials in the replay
_WRITTEN = (STORE, "campaign.html", "summary.json", "figures", "worst")


def table(results: Results, summary_data: dict) -> Table:
    """One row per combination of the swept values."""
    swept = list(results.campaign.axes)
    metric_names = [*results.tracking, "input_rms"]
    counts = ("trials", "failed", "invalid") if summary_data["invalid"] else ("trials", "failed")
    metrics = (f"{name.replace('_', ' ')}, {display_units(0.0, results.unit(name))[1]}" for name in metric_names)
    table = titled("Median [5 %, 95 %] of completed trials", *swept, *counts, "within", *metrics)
    for combination in summary_data["combinations"]:
        cells = [_spread(combination["metrics"].get(name), results.unit(name)) for name in metric_names]
        table.add_row(
            *(combination["values"][key] for key in swept),
            *(str(combination[count]) for count in counts),
            _within(combination),
            *cells,
        )
    return table


def _within(combination: dict) -> str:
    """Share of the trials of a combination that kept to the scenario's criterion of success."""
    judged = combination["success"]["within"] + combination["success"]["not_within"]
    return f"{100 * combination['success']['within'] / judged:.1f} %" if judged else "-"


def _spread(quantiles: dict | None, unit: str) -> str:
    if quantiles is None:
        return "-"
    low, middle, high = (display_units(value, unit)[0] for value in quantiles.values())
    return f"{middle:.3g} [{low:.3g}, {high:.3g}]"
