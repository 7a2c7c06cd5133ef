"""What to see in each figure, with the numbers of this run."""

from typing import Any

from undertow.report.formats import number
from undertow.report.page import Html, join


def captions(results: dict[str, Any]) -> dict[str, Html]:
    """Caption of every figure by name; numbers that are missing are left out."""
    one, two = results.get("example1", {}), results.get("example2", {})
    return {
        "fig02": join(
            "The motor of Table 3 driven by V = 10 sin t and V = 10 sin 10t, one period after start-up. With the slow "
            "voltage thrust nearly is a function of current or voltage, with the fast one it is not: the loops open. "
            "The laws are fitted to the slow voltage by least squares; (c) is how far each is off on either."
        ),
        "fig06": join(
            "Both controllers reach the wanted pose and look alike; the error on a logarithmic scale tells them apart. "
            "It first falls as exp(\u2212t), whatever the gains, then stays where the disturbance holds it.",
            _pair(one, "tracking_rms", "Rms error after 10 s"),
        ),
        "fig07": join(
            "RCAFC follows steps, ramp and both sinusoids; RAFC lags by about half a second and hardly follows the "
            "fast ones. The lower panels are the estimate less the truth. The y axes are made for what comes "
            "after the first second; what leaves them before is written above.",
            _pair(one, "estimation_rms", "Rms error of the estimate after 10 s"),
        ),
        "fig08": join(
            "Above the whole run, below its second half. The robust term is small where the estimate is good: at low "
            "frequency it nearly equals the error of the estimate (Fig. 7), so the two are one merit, not two.",
            _pair(one, "robust_rms", "Rms after 10 s"),
        ),
        "fig09": join(
            "Left the first second, right the rest, on scales of their own. The start asks for voltages no supply "
            "gives; after it the two controllers need the same voltage, because the same disturbance must be met.",
            _pair(one, "input_peak", "Largest voltage, V", "whole"),
            _pair(one, "input_variation", "Variation after 10 s, V/s"),
        ),
        "fig10": join(
            "Without speed sensors, on a motor that is in its steady state at every instant, RCAFC tracks nearly as in "
            "Example 1.",
            _single(two, "tracking_rms", "Rms error after 10 s"),
        ),
        "fig11": join(
            "The state of the series-parallel model lies on the vehicle's; the lower panels show the difference in mm "
            "and mrad. Nothing pulls the model's position back to the vehicle's, so the offset from the start stays: "
            "it is no estimate of position.",
            _single(two, "model_rms", "Rms of the modelling error in velocity after 10 s"),
        ),
        "fig12": join(
            "The motor's curve now is part of d, which is larger than in Fig. 7 and has kinks where a thruster changes "
            "direction: near zero volts the motor gives almost no thrust.",
            _single(two, "uncertainty_rms", "Rms of d after 10 s"),
            _single(two, "estimation_rms", "Rms error of the estimate"),
        ),
        "fig13": join(
            "As Fig. 9, for RCAFC without speed sensors.",
            _single(two, "input_peak", "Largest voltage, V", "whole"),
        ),
        "fidelity": join(
            "The law of Table 1 on four truths of the same thruster. A cross marks a run that ended early."
        ),
        "sweep": join(
            "Points are measured, lines are the linear theory. Where a point lies above 1, the estimate adds error "
            "instead of removing it."
        ),
    }


def _pair(example: dict[str, Any], metric: str, what: str, window: str = "steady") -> Html:
    """A metric of both controllers, as a sentence."""
    rcafc, rafc = (_metric(example, key, metric, window) for key in ("rcafc", "rafc"))
    if rcafc is None or rafc is None:
        return Html("")
    return join(f" {what}: RCAFC ", number(rcafc), ", RAFC ", number(rafc), ".")


def _single(example: dict[str, Any], metric: str, what: str, window: str = "steady") -> Html:
    rcafc = _metric(example, "rcafc", metric, window)
    return Html("") if rcafc is None else join(f" {what}: ", number(rcafc), ".")


def _metric(example: dict[str, Any], key: str, metric: str, window: str) -> float | None:
    return ((example.get(key) or {}).get(window) or {}).get(metric)
