"""What `undertow analyze` predicts, as rows of plain text: for a terminal and for a page."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from undertow.analysis.metrics import for_people
from undertow.prediction.predict import Prediction


class Rows(NamedTuple):
    """One table: title, heads of its columns, rows; what it means in a sentence."""

    title: str
    head: tuple[str, ...]
    rows: list[tuple[str, ...]]
    sentence: str


def tables(prediction: Prediction) -> list[Rows]:
    """All tables, the most important first; empty ones left out."""
    made = (_points, _margins, _estimators, _errors, _noise, _closed_forms, _reach, _metrics)
    return [table for make in made if (table := make(prediction)).rows]


def _points(prediction: Prediction) -> Rows:
    rows = [
        (
            f"{point.share:.0%}",
            f"{point.used:.0%}" if point.used else "-",
            _pole(point.poles[0]) if len(point.poles) else "-",
            f"{point.radius:.6f}",
            ("stable" if point.radius < 1 else "unstable") if point.found else "not held",
        )
        for point in prediction.points
    ]
    return Rows(
        "Poles over the operating range",
        ("of loads smaller", "input used", "rightmost pole, 1/s", "spectral radius", "verdict"),
        rows,
        "The whole loop, linearised exactly where it rests under loads along the reference; fuzzy weights held.",
    )


def _margins(prediction: Prediction) -> Rows:
    known, dt = prediction.margins, prediction.operating_point.linear.dt
    rows = [
        ("sampling time, these gains", _time(known["sampling_time"]), f"now {_time(dt)}"),
        ("delay from law to actuators", _time(known["delay"]), "unknown to the law"),
        ("further first-order lag", _time(known["lag"]), "unknown to the law"),
        ("effect of the input, smallest", _number(known["gain_low"]), "of what the law takes it for"),
        ("effect of the input, largest", _number(known["gain_high"]), "likewise"),
    ]
    return Rows(
        "How much the loop bears before it is unstable",
        ("", "at most", ""),
        rows,
        "At the operating point nearest to instability.",
    )


def _estimators(prediction: Prediction) -> Rows:
    rows = [
        (axis, _number(frequency), _number(damping), "-" if ramp is None else _number(ramp))
        for axis, frequency, damping, ramp in _together(prediction.estimators)
    ]
    return Rows(
        "Estimator",
        ("axis", "bandwidth w_o, rad/s", "damping", "|d_hat - d| per |d_dot|, s"),
        rows,
        "Closed forms of the law alone, with an exact model and actuators that obey at once.",
    )


def _errors(prediction: Prediction) -> Rows:
    frequency, names = prediction.frequency, prediction.operating_point.built.closed_loop.plant.outputs
    rows = []
    for i, name in enumerate(names):
        error, missed = prediction.error[:, i], prediction.estimation[:, i]
        at = [_number(float(np.interp(w, frequency, error))) for w in (0.1, 1.0, 10.0)]
        worse = frequency[missed > 1]
        rows.append(
            (
                name,
                *at,
                f"{_number(error.max())} at {_number(frequency[error.argmax()])} rad/s",
                f"{_number(worse[0])} rad/s" if worse.size else "nowhere",
            )
        )
    return Rows(
        "Error per unit of disturbance",
        ("axis", "at 0.1 rad/s, s^2", "at 1 rad/s", "at 10 rad/s", "most", "estimate worse than none from"),
        rows,
        "|e| per |d|, m per m/s^2 or rad per rad/s^2, under the mean load.",
    )


def _noise(prediction: Prediction) -> Rows:
    noise, unit = prediction.noise, prediction.operating_point.built.closed_loop.plant.input_unit
    rows = [
        (f"input, {unit} per cm/s or 0.01 rad/s", _number(0.01 * noise.of_input.max())),
        ("estimate, m/s^2 or rad/s^2 per the same", _number(0.01 * noise.of_estimate.max())),
        ("velocity noise that fills the input (3 sigma), m/s or rad/s", _number(noise.largest)),
    ]
    return Rows(
        "White noise on measured velocities",
        ("", "standard deviation"),
        rows,
        "From the discrete Lyapunov equation of the sampled loop; new at every step.",
    )


def _closed_forms(prediction: Prediction) -> Rows:
    rows = [
        (form.meaning, _pole(form.expected), _pole(form.nearest), f"{form.departure:.2g}") for form in prediction.forms
    ]
    return Rows(
        "Closed forms beside the whole loop",
        ("pole", "closed form, 1/s", "nearest of the whole loop, 1/s", "apart, share"),
        rows,
        "What motors, coupling and sampling add to the theory's small model.",
    )


def _reach(prediction: Prediction) -> Rows:
    authority = prediction.authority
    finite = np.isfinite(authority.high).any()
    rows = [
        ("demand held whole, share of the time", f"{authority.held:.0%}"),
        ("smallest share of a demand", f"{authority.share.min():.0%}"),
        ("largest force that one actuator is asked for", _number(float(authority.demand.max()))),
        (
            "it can give, forward / reverse",
            f"{_number(authority.high.min())} / {_number(-authority.low.max())}" if finite else "-",
        ),
    ]
    return Rows(
        "Actuators", ("", ""), rows, "Forces settled at the limits of the input, against what the loads demand."
    )


def _metrics(prediction: Prediction) -> Rows:
    known = prediction.operating_point.built.known_metrics()
    rows = []
    for name, value in (prediction.metrics or {}).items():
        shown, unit = for_people(value, known[name].unit)
        rows.append((name, _number(shown), unit))
    return Rows(
        "Metrics predicted for the steady window",
        ("metric", "predicted", "unit"),
        rows,
        "The linearised loop driven by the disturbance and the sensor's errors along the reference; "
        "`undertow simulate` puts the measured ones beside them.",
    )


def _together(rows: Sequence[tuple]) -> list[tuple]:
    """Axes with the same numbers in one row."""
    joined: dict[tuple, list[str]] = {}
    for axis, *numbers in rows:
        joined.setdefault(tuple(numbers), []).append(axis)
    return [("all" if len(axes) == len(rows) > 1 else ", ".join(axes), *numbers) for numbers, axes in joined.items()]


def _pole(pole: complex) -> str:
    return f"{pole.real:.4g}" + (f" +- {abs(pole.imag):.4g}j" if abs(pole.imag) > 1e-6 * abs(pole) else "")


def _time(value: float) -> str:
    return "any" if np.isinf(value) else "none" if value == 0 else f"{1e3 * value:.3g} ms"


def _number(value: float) -> str:
    return "any" if np.isinf(value) else f"{value:.3g}"
