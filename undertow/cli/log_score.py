"""`undertow logs score`: how far the model of a scenario is from a log."""

from pathlib import Path

from undertow.cli.exit_codes import DONE
from undertow.cli.interruptible import interruptible
from undertow.cli.logs import check_words
from undertow.cli.options.logs import LogsCommand
from undertow.cli.results_folder import output_folder, results_folder
from undertow.cli.stages import stage
from undertow.cli.tables import numbers, titled, wide_console
from undertow.core.json_text import to_json
from undertow.outside.log_score import AXES, UNITS, score
from undertow.report.figures import save
from undertow.report.figures.log_score import log_score_figure
from undertow.scenario.build import build
from undertow.scenario.log_file import read_log
from undertow.scenario.reading import read

_WRITTEN = ("score.json", "figures")


def score_log(command: LogsCommand) -> int:
    """Score the model of a scenario against a log, and write score.json and figures/ to a folder."""
    check_words(command.words[1:], 2, "score SCENARIO FILE")
    scenario, path = (Path(word) for word in command.words[1:])
    console = wide_console()
    with (
        output_folder(command.out, Path("runs") / f"{scenario.stem}-score") as folder,
        results_folder(folder, _WRITTEN, "score.json", command.overwrite) as draft,
    ):
        with stage(console, "reading and building"):
            log = read_log(path, command.mapping)
            built = build(read(scenario, allow_code=command.allow_code))
        with stage(console, "predicting"):
            prediction_score = interruptible(lambda: score(built, log))
        summary = {"log": log.source} | prediction_score.summary()
        (draft.path / "score.json").write_text(to_json(summary, indent=1) + "\n", encoding="utf-8")
        save(log_score_figure(prediction_score.curve, prediction_score.growth), draft.path / "figures", "score")
    title = f"Error of the predicted motion, rms over {len(prediction_score.starts)} starts"
    table = titled(title, "axis", *(numbers(f"{horizon:g} s") for horizon in prediction_score.horizons), "unit")
    for axis, unit, errors in zip(AXES, UNITS, prediction_score.rms.T, strict=True):
        table.add_row(axis, *(f"{error:.4g}" for error in errors), unit)
    console.print(table)
    for warning in prediction_score.warnings:
        console.print(f"Warning: {warning}.", highlight=False, soft_wrap=True)
    console.print(f"Results: {folder}", highlight=False, soft_wrap=True)
    return DONE
