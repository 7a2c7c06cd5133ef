"""Captions of the figures, with the numbers of this run."""

from typing import Any

from undertow.paper.all_outputs import unit_of
from undertow.report.formats import number, prose
from undertow.report.mathml import mathml
from undertow.report.page import Html, join


def captions(results: dict[str, Any]) -> dict[str, Html]:
    """Caption of every figure by name; missing numbers are left out."""
    example1, example2 = results.get("example1", {}), results.get("example2", {})
    return {
        "fig02": join(
            "The motor of Table 3 driven by ",
            mathml(r"V = 10 \sin t"),
            " and ",
            mathml(r"V = 10 \sin 10 t"),
            ", one period after start-up. With the slow voltage, thrust is nearly a function of current or voltage. "
            "With the fast one it is not: the curves open to loops. The static models are fitted to the slow voltage "
            "by least squares; (c) shows the error of each for both voltages.",
        ),
        "fig06": join(
            "Both controllers reach the desired pose and look alike; the error on a logarithmic scale shows the "
            "difference. It first falls as ",
            mathml(r"\exp(-t)"),
            " for all gains, and then stays at a level set by the disturbance.",
            _pair(example1, "tracking_rms", "Rms error after 10 s"),
        ),
        "fig07": join(
            "RCAFC follows steps, ramp and both sinusoids; RAFC lags by about half a second and hardly follows the "
            "fast ones. The lower panels show the estimation error. The y axes fit the values after the first second; "
            "larger values before are noted above the panels.",
            _pair(example1, "estimation_rms", "Rms error of the estimate after 10 s"),
        ),
        "fig08": join(
            "The upper panels show the whole run, the lower panels its second half. The robust term is small where the "
            "estimate is good. At low frequency it nearly equals the estimation error (Fig. 7), so the two are not "
            "independent advantages.",
            _pair(example1, "robust_rms", "Rms after 10 s"),
        ),
        "fig09": join(
            "The left panels show the first second, the right panels the rest, on separate scales. The start demands "
            "voltages that no supply gives. After it both controllers need the same voltage, because they counteract "
            "the same disturbance.",
            _pair(example1, "input_peak", "Largest voltage", "whole"),
            _pair(example1, "input_variation", "Variation after 10 s"),
        ),
        "fig10": join(
            "Without speed sensors, with a motor in its steady state at every instant, RCAFC tracks nearly as in "
            "Example 1.",
            _single(example2, "tracking_rms", "Rms error after 10 s"),
        ),
        "fig11": join(
            "The state of the series-parallel model coincides with that of the vehicle; the lower panels show the "
            "difference in mm and mrad. Nothing drives the position of the model to that of the vehicle, so the "
            "initial offset stays: it is not an estimate of position.",
            _single(example2, "model_rms", "Rms of the modelling error in velocity after 10 s"),
        ),
        "fig12": join(
            "The characteristic of the motor is now part of the uncertainty, which is larger than in Fig. 7 and has "
            "kinks where a thruster changes direction: near zero volts the motor gives almost no thrust.",
            _single(example2, "uncertainty_rms", "Rms of d after 10 s"),
            _single(example2, "estimation_rms", "Rms error of the estimate"),
        ),
        "fig13": join(
            "As Fig. 9, for RCAFC without speed sensors.", _single(example2, "input_peak", "Largest voltage", "whole")
        ),
        "fidelity": join(
            "The controllers of Table 1 on four fidelity levels of the same thruster. A cross marks a run that ended "
            "early."
        ),
        "sweep": join(
            "Points are measured, lines are the linear theory. Where a point lies above 1, the estimate increases the "
            "error."
        ),
    }


def _pair(example: dict[str, Any], metric: str, what: str, window: str = "steady") -> Html:
    """A sentence with a metric of both controllers."""
    rcafc, rafc = (_metric(example, key, metric, window) for key in ("rcafc", "rafc"))
    if rcafc is None or rafc is None:
        return Html("")
    return join(f" {what}: RCAFC ", number(rcafc), ", RAFC ", _with_unit(rafc, metric), ".")


def _single(example: dict[str, Any], metric: str, what: str, window: str = "steady") -> Html:
    rcafc = _metric(example, "rcafc", metric, window)
    return Html("") if rcafc is None else join(f" {what}: ", _with_unit(rcafc, metric), ".")


def _with_unit(value: float, metric: str) -> Html:
    return join(number(value), Html("&nbsp;"), prose(unit_of(metric).replace(", ", " and ")))


def _metric(example: dict[str, Any], key: str, metric: str, window: str) -> float | None:
    return ((example.get(key) or {}).get(window) or {}).get(metric)
