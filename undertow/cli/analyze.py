"""`undertow analyze`: predict closed-loop performance and stability margins."""

from pathlib import Path

import typer
from rich.table import Table
from rich.text import Text

from undertow.cli.exit_codes import DONE, warn_of
from undertow.cli.interruptible import interruptible
from undertow.cli.options.analyze import AnalyzeCommand
from undertow.cli.pdf_option import check_pdf
from undertow.cli.results_folder import output_folder, results_folder
from undertow.cli.stages import shares
from undertow.cli.tables import print_lines, titled, wide_console
from undertow.core.json_text import to_json
from undertow.report.answers.analysis_answer import answer_of_prediction
from undertow.report.prediction_page import PredictionTable, tables, write_prediction
from undertow.scenario.build import build
from undertow.scenario.checks.flow_stability import flow_advice
from undertow.scenario.reading import read
from undertow.studies.prediction.predict import predict, summary
from undertow.studies.prediction.scenario_warnings import advice

_WRITTEN = ("prediction.html", "prediction.json", "figures")


def analyze(command: AnalyzeCommand) -> int:
    """Predict a scenario and write the page to `out`, or to a free folder under runs/; return the exit code."""
    check_pdf(command.pdf)
    console = wide_console()
    with (
        output_folder(command.out, Path("runs") / f"{command.scenario.stem}-prediction") as folder,
        results_folder(folder, _WRITTEN, "prediction.json", command.overwrite) as draft,
    ):
        built = build(read(command.scenario, allow_code=command.allow_code))
        with shares(console) as progress:
            prediction = interruptible(lambda: predict(built, progress, command.vehicles))
        all_advice = (*built.advice(), *flow_advice(built))
        warnings = (*(piece.sentence for piece in all_advice), *advice(prediction))
        text = to_json(summary(prediction), indent=1) + "\n"
        (draft.path / "prediction.json").write_text(text, encoding="utf-8")
        draft.publish()  # before the figures, which may fail
        warn_of(write_prediction(prediction, warnings, draft.path, command.pdf))
    for rows in tables(prediction) if command.details else ():
        console.print(_table(rows))
    print_lines(console, answer_of_prediction(prediction).text)
    page = f"Page: {folder / 'prediction.html'}"
    print_lines(console, [page] if command.details else [page, "Next: --details prints all tables."])
    for sentence in dict.fromkeys(warnings):
        typer.echo(f"Advice: {sentence}", err=True)
    return DONE


def _table(rows: PredictionTable) -> Table:
    table = titled(rows.title, *rows.head)
    table.caption, table.caption_justify = rows.sentence, "left"
    for row in rows.rows:
        table.add_row(*map(Text, row))
    return table
