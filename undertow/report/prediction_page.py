"""The page of `undertow analyze`: closed-loop performance and stability margins."""

from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np

from undertow.analysis.theory import theory_of
from undertow.core.number_text import display_units
from undertow.report.answers.analysis_answer import answer_of_prediction
from undertow.report.answers.plain_answer import answer_block
from undertow.report.figures.prediction import force_label, prediction_plots
from undertow.report.figures.writing import save_all
from undertow.report.formats import prose
from undertow.report.page import bullets, document, figure, section, table, tag
from undertow.simulation.loop.dataset import input_names
from undertow.studies.prediction.linearized_points import nearest_to_instability
from undertow.studies.prediction.predict import Prediction


class PredictionTable(NamedTuple):
    """One table: title, column titles, rows, and a sentence that explains it."""

    title: str
    head: tuple[str, ...]
    rows: list[tuple[str, ...]]
    sentence: str


_CAPTIONS = {
    "poles": "Controllable closed-loop poles of the sampled loop as continuous-time poles, with motors and coupling. "
    "Both axes are linear near zero and logarithmic beyond.",
    "frequency": "Gain from a disturbance on one axis to the error on the same axis, under the mean load.",
    "actuators": "Forces that each actuator must give under the loads along the reference, without limits.",
}


def write_prediction(prediction: Prediction, advice: Sequence[str], folder: Path, pdf: str | None = None) -> list[str]:
    """Write `prediction.html`, and every figure into `figures/`; return sentences on failures.

    `pdf` is the width of PDF files; None for none.

    Raises:
        OSError: the folder cannot be written.
    """
    saved = save_all(lambda: prediction_plots(prediction), folder / "figures", pdf)
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
        answer_block(answer_of_prediction(prediction)),
        *figures[:1],
        *warnings,
        *(_section(number, rows) for number, rows in enumerate(tables(prediction))),
        *([section("figures", "More figures", *figures[1:])] if figures[1:] else []),
        tag("p", prose(LEFT_OUT), class_="small"),
    )
    (folder / "prediction.html").write_text(page, encoding="utf-8")
    return saved.failures


LEFT_OUT = (
    "The loop is linearised at its equilibrium. Saturation, dead zones, pulses of speed controllers and large motions "
    "are left out, and a moving reference is treated as one at rest under the loads that the motion causes. `undertow "
    "simulate` reports metrics that depart by more than 10 %."
)


def _section(number: int, rows: PredictionTable):
    cells = [[prose(cell) for cell in row] for row in rows.rows]
    content = table([prose(cell) for cell in rows.head], cells, wide=len(rows.head) > 3)
    return section(f"table-{number}", rows.title, tag("p", prose(rows.sentence)), content)


def tables(prediction: Prediction) -> list[PredictionTable]:
    """All tables, the most important first, without empty ones."""
    makers = (_points, _margins, _vehicles, _estimators, _errors, _noise, _closed_forms, _authority, _metrics)
    return [table for make in makers if (table := make(prediction)).rows]


def _points(prediction: Prediction) -> PredictionTable:
    rows = [
        (
            point.where,
            "-" if point.flow is None else f"{point.flow:.2f}",
            _percent(point.used) if point.used else "-",
            _pole(point.poles[0]) if len(point.poles) else "-",
            f"{point.radius:.6f}",
            ("stable" if point.radius < 1 else "unstable") if point.found else "no equilibrium",
        )
        for point in prediction.points
    ]
    return PredictionTable(
        "Controllable closed-loop poles over the operating range",
        ("operating point", "flow, m/s", "input used", "rightmost pole, 1/s", "spectral radius", "verdict"),
        rows,
        f"The whole loop, linearised at rest under loads along the reference{_at_fixed_weights(prediction)}. "
        "Flow is the speed of the water past the vehicle; its drag and moments change as the vehicle turns and moves.",
    )


def _at_fixed_weights(prediction: Prediction) -> str:
    law = prediction.operating_point.built.closed_loop.controller
    return ", with constant fuzzy weights" if theory_of(law).adapts else ""


def _margins(prediction: Prediction) -> PredictionTable:
    margins = prediction.margins
    dt = prediction.operating_point.linear.dt
    nearest = nearest_to_instability(prediction.points)
    if not nearest.found or nearest.radius >= 1:
        why = f"the loop is unstable: {nearest.growing}" if nearest.found else "the loop has no equilibrium"
        return PredictionTable("Robustness margins", ("margin", "remark"), [("none", why)], "")
    rows = [
        ("sampling limit at these gains", _time(margins["sampling_time"]), f"sampling time {_time(dt)}"),
        ("delay margin, controller to actuators", _time(margins["delay"]), "beyond the nominal model"),
        ("margin of an additional first-order lag", _time(margins["lag"]), "beyond the nominal model"),
        ("gain margin, decreasing", _number(margins["gain_low"]), "of the nominal effect of the input"),
        ("gain margin, increasing", _number(margins["gain_high"]), "of the nominal effect of the input"),
    ]
    return PredictionTable(
        "Robustness margins", ("margin", "limit", "remark"), rows, "At the operating point closest to instability."
    )


def _vehicles(prediction: Prediction) -> PredictionTable:
    rows = [
        (
            vehicle.name,
            *(_time(vehicle.margins[name]) for name in ("sampling_time", "delay", "lag")),
            *(_number(vehicle.margins[name]) for name in ("gain_low", "gain_high")),
            f"{vehicle.radius:.6f}",
            "stable" if vehicle.is_stable else "unstable" if vehicle.found else "no equilibrium",
        )
        for vehicle in sorted(prediction.vehicles, key=lambda vehicle: -vehicle.radius)
    ]
    head = ("vehicle", "sampling limit", "delay margin", "lag margin", "gain at least", "gain at most")
    return PredictionTable(
        "Margins of vehicles within the deviations of the file",
        (*head, "spectral radius", "verdict"),
        rows,
        "Vehicles at random, each at its operating point closest to instability; the controller has the numbers of the "
        "file. That closest to instability comes first.",
    )


def _estimators(prediction: Prediction) -> PredictionTable:
    rows = [
        (axis, _number(frequency), _number(damping), "-" if ramp is None else _number(ramp))
        for axis, frequency, damping, ramp in _together(prediction.estimators)
    ]
    return PredictionTable(
        "Estimator",
        ("axis", "bandwidth, rad/s", "damping", "|d_hat - d| per |d_dot|, s"),
        rows,
        "Closed forms of the controller alone, with an exact nominal model and ideal actuators.",
    )


_SHOWN = (0.1, 1.0, 10.0)  # rad/s


def _errors(prediction: Prediction) -> PredictionTable:
    frequency = prediction.frequency
    names = prediction.operating_point.built.closed_loop.plant.outputs
    rows = []
    for i, name in enumerate(names):
        error, estimation = prediction.error[:, i], prediction.estimation[:, i]
        gains = [_number(float(np.interp(w, frequency, error))) for w in _SHOWN]
        worse = frequency[estimation > 1]
        rows.append(
            (
                name,
                *gains,
                f"{_number(error.max())} at {_number(frequency[error.argmax()])} rad/s",
                f"{_number(worse[0])} rad/s" if worse.size else "none",
            )
        )
    return PredictionTable(
        "Error per unit of disturbance",
        ("axis", *(f"at {w:g} rad/s, s^2" for w in _SHOWN), "maximum, s^2", "estimate increases the error above"),
        rows,
        "|e| per |d|, m per m/s^2 or rad per rad/s^2, under the mean load.",
    )


def _noise(prediction: Prediction) -> PredictionTable:
    noise = prediction.noise
    unit = prediction.operating_point.built.closed_loop.plant.input_unit
    rows = [
        (f"input, {unit}, for 1 cm/s or 0.01 rad/s of noise", _number(0.01 * noise.of_input.max())),
        ("estimate, m/s^2 or rad/s^2, for the same noise", _number(0.01 * noise.of_estimate.max())),
        ("velocity noise at which 3 sigma of the input reach its limit, m/s or rad/s", _number(noise.largest)),
    ]
    return PredictionTable(
        "White noise on measured velocities",
        ("quantity", "standard deviation"),
        rows,
        "From the discrete Lyapunov equation of the sampled loop, with independent noise at every control step.",
    )


def _closed_forms(prediction: Prediction) -> PredictionTable:
    rows = [
        (form.meaning, _pole(form.expected), _pole(form.nearest), f"{form.departure:.2g}") for form in prediction.forms
    ]
    return PredictionTable(
        "Closed forms compared with the whole loop",
        ("pole", "closed form, 1/s", "nearest pole of the whole loop, 1/s", "relative difference"),
        rows,
        "The differences show the effect of motors, coupling and sampling.",
    )


def _authority(prediction: Prediction) -> PredictionTable:
    authority = prediction.authority
    plant = prediction.operating_point.built.closed_loop.plant
    force = force_label(plant).replace("force", "", 1)
    most = int(authority.demand.argmax())
    finite = np.isfinite(authority.high).any()
    rows = [
        ("share of the time in which the demand is met", _percent(authority.held)),
        ("smallest share of a demand that is met", _percent(authority.share.min())),
        (f"largest force demanded, from {input_names(plant)[most]}{force}", _number(float(authority.demand[most]))),
        (
            f"largest force available, forward / reverse{force}",
            f"{_number(authority.high.min())} / {_number(-authority.low.max())}" if finite else "-",
        ),
    ]
    return PredictionTable(
        "Actuator authority",
        ("quantity", "value"),
        rows,
        "Steady forces at the limits of the input, compared with those that the loads demand.",
    )


def _metrics(prediction: Prediction) -> PredictionTable:
    metrics = prediction.operating_point.built.known_metrics()
    rows = []
    for name, value in (prediction.metrics or {}).items():
        displayed, unit = display_units(value, metrics[name].unit)
        rows.append((name, _number(displayed), unit))
    return PredictionTable(
        "Predicted metrics of the steady window",
        ("metric", "predicted", "unit"),
        rows,
        "The linearised loop, driven by the disturbance and the errors of the navigation filter along the reference. "
        "`undertow simulate` shows the measured metrics beside these.",
    )


def _together(rows: Sequence[tuple]) -> list[tuple]:
    """One row for axes with equal numbers."""
    joined: dict[tuple, list[str]] = {}
    for axis, *numbers in rows:
        joined.setdefault(tuple(numbers), []).append(axis)
    return [("all" if len(axes) == len(rows) > 1 else ", ".join(axes), *numbers) for numbers, axes in joined.items()]


def _pole(pole: complex) -> str:
    return f"{pole.real:.4g}" + (f" +- {abs(pole.imag):.4g}j" if abs(pole.imag) > 1e-6 * abs(pole) else "")


def _time(value: float) -> str:
    return "any" if np.isinf(value) else "none" if value == 0 else f"{1e3 * value:.3g} ms"


def _number(value: float) -> str:
    return "any" if np.isinf(value) else f"{value:.0f}" if 1e3 <= abs(value) < 1e5 else f"{value:.3g}"


def _percent(share: float) -> str:
    return f"{100 * share:.0f} %"
