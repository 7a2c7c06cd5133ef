"""`undertow analyze`: what will happen, before anything is run."""

from pathlib import Path

import typer
from rich.table import Table
from rich.text import Text

from undertow.cli.exit_codes import DONE
from undertow.cli.interruptible import interruptible
from undertow.cli.results_folder import next_free, results_folder
from undertow.cli.stages import shares
from undertow.cli.tables import wide_console
from undertow.report.prediction_page import write_prediction
from undertow.report.prediction_tables import Rows, tables
from undertow.scenario.build import build
from undertow.scenario.labelling import to_json
from undertow.scenario.reading import read
from undertow.studies.prediction.doubts import advice
from undertow.studies.prediction.predict import predict
from undertow.studies.prediction.summary import summary

_WRITTEN = ("prediction.html", "prediction.json", "figures")


def analyze(scenario: Path, out: Path | None, overwrite: bool) -> int:
    """Exit code of a prediction whose page went to `out`, or to a folder under runs/ that was free."""
    console = wide_console()
    folder = next_free(Path("runs") / f"{scenario.stem}-prediction") if out is None else out
    with results_folder(folder, _WRITTEN, "prediction.json", overwrite) as staging:
        built = build(read(scenario))
        with shares(console) as progress:
            prediction = interruptible(lambda: predict(built, progress))
        doubts = (*built.advice(), *advice(prediction))
        (staging / "prediction.json").write_text(to_json(summary(prediction), indent=1) + "\n", encoding="utf-8")
        write_prediction(prediction, doubts, staging)
    for rows in tables(prediction):
        console.print(_table(rows))
    if prediction.why_not:
        console.print(f"No metrics foretold: {prediction.why_not}.", highlight=False, soft_wrap=True)
    for sentence in dict.fromkeys(doubts):
        typer.echo(f"Advice: {sentence}", err=True)
    console.print(f"Page: {folder / 'prediction.html'}", highlight=False, soft_wrap=True)
    return DONE


def _table(rows: Rows) -> Table:
    table = Table(
        *rows.head,
        title=rows.title,
        title_justify="left",
        title_style="bold",
        caption=rows.sentence,
        caption_justify="left",
    )
    for row in rows.rows:
        table.add_row(*map(Text, row))
    return table
