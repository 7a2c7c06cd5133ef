"""The page of `undertow analyze`: closed-loop performance and stability margins."""

from collections.abc import Sequence
from pathlib import Path

from undertow.prediction.predict import Prediction
from undertow.report.figures.prediction import prediction_plots
from undertow.report.figures.writing import save_all
from undertow.report.formats import prose
from undertow.report.page import bullets, document, figure, section, table, tag
from undertow.report.prediction_tables import Rows, tables

_CAPTIONS = {
    "poles": "Controllable closed-loop poles of the sampled loop as continuous-time poles, with motors and coupling. "
    "Both axes are linear near zero and logarithmic beyond.",
    "frequency": "Gain from a disturbance on one axis to the error on the same axis, under the mean load.",
    "actuators": "Forces that each actuator must give under the loads along the reference, without limits.",
}


def write_prediction(prediction: Prediction, advice: Sequence[str], folder: Path) -> list[str]:
    """Write `prediction.html`, and every figure as SVG and PNG into `figures/`; return sentences on failures.

    Raises:
        OSError: the folder cannot be written.
    """
    saved = save_all(lambda: prediction_plots(prediction), folder / "figures")
    figures = [tag("p", prose(sentence)) for sentence in saved.failures]
    for name, vector in saved.vectors.items():
        caption = _CAPTIONS[name]
        figures.append(figure(vector.read_text(encoding="utf-8"), name, caption, caption))
    title = prediction.operating_point.built.scenario.description or "a closed loop"
    warnings = [tag("h2", "Advice"), bullets([prose(sentence) for sentence in advice])] if advice else []
    page = document(
        f"Prediction: {title}",
        tag("h1", "Prediction from the linearised closed loop"),
        tag("p", prose(title), class_="lead"),
        *warnings,
        *(_section(number, rows) for number, rows in enumerate(tables(prediction))),
        section("figures", "Figures", *figures),
        tag("p", prose(LEFT_OUT), class_="small"),
    )
    (folder / "prediction.html").write_text(page, encoding="utf-8")
    return saved.failures


LEFT_OUT = (
    "The loop is linearised at its equilibrium. Saturation, dead zones, pulses of speed controllers and large motions "
    "are left out, and a moving reference is treated as one at rest under the loads that the motion causes. `undertow "
    "simulate` reports metrics that depart by more than 10 %."
)


def _section(number: int, rows: Rows):
    cells = [[prose(cell) for cell in row] for row in rows.rows]
    head = [prose(cell) for cell in rows.head]
    return section(
        f"table-{number}", rows.title, tag("p", prose(rows.sentence)), table(head, cells, wide=len(rows.head) > 3)
    )
