"""The page of `undertow analyze`: what will happen, before anything is run."""

from collections.abc import Sequence
from pathlib import Path

from undertow.prediction.predict import Prediction
from undertow.report.figures.prediction import prediction_drawings
from undertow.report.figures.writing import save_all
from undertow.report.formats import prose
from undertow.report.page import bullets, document, figure, section, table, tag
from undertow.report.prediction_tables import Rows, tables

_CAPTIONS = {
    "poles": "Poles that control can move, of the sampled loop as rates, motors and coupling included; both axes are "
    "linear near zero and logarithmic beyond.",
    "frequency": "Gains from a disturbance on one axis to the error on the same axis, under the mean load.",
    "actuators": "Forces that the loads along the reference demand of each actuator, as if there were no limits.",
}


def write_prediction(prediction: Prediction, advice: Sequence[str], folder: Path) -> list[str]:
    """Write `prediction.html`, and every figure as SVG and PNG into `figures/`; what could not be drawn, in sentences.

    Raises:
        OSError: the folder cannot be written.
    """
    saved = save_all(lambda: prediction_drawings(prediction), folder / "figures")
    drawn = [tag("p", prose(sentence)) for sentence in saved.failures]
    for name, vector in saved.vectors.items():
        said = _CAPTIONS[name]
        drawn.append(figure(vector.read_text(encoding="utf-8"), name, said, said))
    title = prediction.operating_point.built.scenario.description or "a closed loop"
    warnings = [tag("h2", "Advice"), bullets([prose(sentence) for sentence in advice])] if advice else []
    page = document(
        f"Prediction: {title}",
        tag("h1", "Before anything is run"),
        tag("p", prose(title), class_="lead"),
        *warnings,
        *(_section(number, rows) for number, rows in enumerate(tables(prediction))),
        section("drawn", "Figures", *drawn),
        tag("p", prose(LEFT_OUT), class_="small"),
    )
    (folder / "prediction.html").write_text(page, encoding="utf-8")
    return saved.failures


LEFT_OUT = (
    "Linearised about rest: limits, dead zones, pulses of speed controllers and large motions are left out, and a "
    "moving reference counts as one at rest under the loads that moving brings. `undertow simulate` says what departs "
    "by more than 10 %."
)


def _section(number: int, rows: Rows):
    cells = [[prose(cell) for cell in row] for row in rows.rows]
    head = [prose(cell) for cell in rows.head]
    return section(
        f"table-{number}", rows.title, tag("p", prose(rows.sentence)), table(head, cells, wide=len(rows.head) > 3)
    )
