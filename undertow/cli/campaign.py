"""`undertow campaign`: run a Monte Carlo study or a parameter sweep, and summarise it."""

from pathlib import Path

from rich.console import Console
from rich.table import Table

from undertow.analysis.metrics import for_people
from undertow.cli.commands.understand import CampaignCommand
from undertow.cli.exit_codes import DONE, RUN_FAILED, warn_of
from undertow.cli.pdf_option import check_pdf
from undertow.cli.replay_option import check_replay, run_again
from undertow.cli.stages import stage
from undertow.cli.tables import titled, wide_console
from undertow.cli.trials import built_with_advice, resumable, run_trials, trial_text, trials_folder, worker_count
from undertow.core.atomic_io import replacing_folder, write_whole
from undertow.core.errors import BadInput
from undertow.core.json_text import to_json
from undertow.report.campaign_page import by_xla, write_campaign
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
            return _conclude(console, prepared, folder, command.pdf, replay)


def _conclude(console: Console, prepared: Prepared, folder: Path, pdf: str | None, replay: bool) -> int:
    """Write page, summary and the scenarios of the worst trials; print the summary."""
    with stage(console, "summary"):
        results = load(folder)
        found = summary(results, prepared.trials)
    shown, part_cache = found["worst"][:_REPLAYED] if replay else [], PartCache()
    worst = {f"trial {trial}": build_trial(prepared.trials, part_cache, trial) for trial in shown}
    replays, missing = run_again(console, worst)
    with stage(console, "page"):
        write_whole(folder / "summary.json", to_json(found, indent=1) + "\n")
        _write_worst(prepared, found["worst"], folder / "worst")
        title = prepared.trials.campaign.description or f"Campaign {prepared.trials.text.name}"
        page, failures = write_campaign(title, results, found, folder, pdf, replays)
    warn_of([*missing, *failures])
    console.print(table(results, found))
    for sentence in sentences(found):
        console.print(sentence, highlight=False, soft_wrap=True)
    console.print(f"Page: {page}", highlight=False, soft_wrap=True)
    return DONE if set(found["status"]) <= {"completed"} else RUN_FAILED


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


def table(results: Results, found: dict) -> Table:
    """One row per combination of the swept values."""
    swept, shown = list(results.campaign.axes), [*results.tracking, "input_rms"]
    counts = ("trials", "failed", "invalid") if found["invalid"] else ("trials", "failed")
    metrics = (f"{name.replace('_', ' ')}, {for_people(0.0, results.unit(name))[1]}" for name in shown)
    table = titled("Median [5 %, 95 %] of completed trials", *swept, *counts, "within", *metrics)
    for one in found["combinations"]:
        cells = [_spread(one["metrics"].get(name), results.unit(name)) for name in shown]
        table.add_row(
            *(one["values"][key] for key in swept), *(str(one[count]) for count in counts), _within(one), *cells
        )
    return table


def _within(one: dict) -> str:
    """Share of the trials of a combination that kept to the scenario's criterion of success."""
    judged = one["success"]["within"] + one["success"]["not_within"]
    return f"{100 * one['success']['within'] / judged:.1f} %" if judged else "-"


def _spread(quantiles: dict | None, unit: str) -> str:
    if quantiles is None:
        return "-"
    low, middle, high = (for_people(value, unit)[0] for value in quantiles.values())
    return f"{middle:.3g} [{low:.3g}, {high:.3g}]"


def sentences(found: dict) -> list[str]:
    """The numbers of trials by status, and the verdict on each requirement."""
    ended = ", ".join(f"{word} {number}" for word, number in found["status"].items())
    text = [f"{found['done']} trials: {ended}."]
    text += [sentence for sentence in (found["nominal_model"], by_xla(found)) if sentence]
    text += [f"Invalid trials ({one['trials']} with this error): {one['why']}." for one in found["invalid"]]
    for one in found["combinations"]:
        of = "".join(f", {key} {value}" for key, value in one["values"].items())
        for requirement in one["requirements"]:
            low, high = (100 * bound for bound in requirement["interval"])
            formula, name = requirement["formula"], requirement["metric"]
            bound = f"{name} < {requirement['below']:g}" if formula is None else f"{name} ({formula})"
            text.append(
                f"Requirement {bound} in {100 * requirement['share']:g} % of the trials{of}: {requirement['verdict']}; "
                f"kept by {100 * requirement['kept']:.1f} % (95 % interval {low:.1f} to {high:.1f} %)."
            )
    return text
