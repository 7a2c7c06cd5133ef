"""Tables of one run, as rows of text: for the terminal and for the page."""

from collections.abc import Mapping, Sequence
from math import isinf
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, NamedTuple

from undertow.control.supervision.transition_log import SupervisorTransition
from undertow.core.metric import Metric
from undertow.core.number_text import display_units, infinite

if TYPE_CHECKING:  # it loads SciPy, which a run does not need
    from undertow.analysis.linearization.response import MetricComparison


# Reasons of the supervisor that a failed thruster explains as well, and what is said where none was found.
_TRACKING = ("position_error", "attitude_error")
_NOTHING_FOUND = (
    "The tracking error exceeded its limit, and no thruster was found to have failed. The monitor cannot exclude it: "
    "it does not see a thruster fail whose force is small, or whose effect resembles that of another one."
)


_MANIFOLD = 10.0  # a departure of which nobody wants the percentage
WORDS = ("unit", "key")  # columns that are no numbers


class RunTable(NamedTuple):
    """A table: title, column titles, rows of words and of numbers to be formatted, and sentences below it."""

    title: str
    head: tuple[str, ...]
    rows: list[tuple[str | float, ...]]
    sentences: tuple[str, ...] = ()
    meanings: Mapping[str, str] = MappingProxyType({})  # of what the first column names


def metrics_rows(
    steady: Mapping[str, Any] | None,
    whole_run: Mapping[str, Any],
    window: tuple[float, float] | None,
    metrics: Mapping[str, Metric],
    predicted: Mapping[str, float] | None = None,
) -> RunTable:
    """Predicted and measured metrics of the steady window, and the metrics of the whole run."""
    rows = []
    for name, metric in metrics.items():
        if name in whole_run:
            displayed = lambda values, name=name, metric=metric: _measured(values[name], metric.unit)
            predicted_cell = [displayed(predicted) if name in predicted else ""] if predicted else []
            steady_cell = displayed(steady) if steady and name in steady else "-"
            cells = *predicted_cell, steady_cell, displayed(whole_run), display_units(0.0, metric.unit)[1]
            rows.append((metric.named(name), *cells, name))
    head = ("metric", *(("predicted",) if predicted else ()), _span(window), "whole run", "unit", "key")
    meanings = {metric.named(name): metric.meaning for name, metric in metrics.items() if name in whole_run}
    return RunTable("Metrics", head, rows, meanings=meanings)


def prediction_rows(
    compared: "Sequence[MetricComparison]", window: tuple[float, float] | None, metrics: Mapping[str, Metric]
) -> RunTable:
    """Predicted and measured metrics of the steady window, and by how much they differ."""
    rows = []
    for comparison in compared:
        unit = metrics[comparison.name].unit
        cells = (_measured(value, unit) for value in (comparison.predicted, comparison.measured))
        departure = "-" if isinf(comparison.departure) else departure_words(comparison.departure)
        name = metrics[comparison.name].named(comparison.name)
        rows.append((name, *cells, departure, display_units(0.0, unit)[1]))
    return RunTable("Prediction", ("metric", "predicted", _span(window), "departs", "unit"), rows)


def departure_words(departure: float) -> str:
    """By how much a run departs from its prediction."""
    return f"by {100 * departure:.0f} %" if departure < _MANIFOLD else "more than tenfold"


def certificate_rows(certificate: Mapping[str, Any], window: tuple[float, float] | None) -> RunTable:
    """The share of the time for which each hypothesis of the stability proof held, and its first failure."""
    rows = []
    for hypothesis in certificate["hypotheses"]:
        if hypothesis["whole"] is None:
            rows.append((f"{hypothesis['sentence']} (not testable: {hypothesis['unknown']})", "-", "-", "-"))
            continue
        first = "never" if hypothesis["first_failure"] is None else f"{hypothesis['first_failure']:.4g} s"
        rows.append((hypothesis["sentence"], _share(hypothesis["steady"]), _share(hypothesis["whole"]), first))
    head = ("hypothesis", _span(window), "whole run", "first fails at")
    return RunTable("Certificate: hypotheses of the stability proof", head, rows, _consequences(certificate))


def memory_rows(certificate: Mapping[str, Any]) -> RunTable:
    """The largest weights of each axis of a memory, and how sure they are."""
    rows: list[tuple[str | float, ...]] = [
        (entry["axis"], entry["regressor"], entry["weight"], _share(entry["variance"]))
        for entry in certificate["memory"]
    ]
    sentences = [
        "The largest weights of each axis, in the unit of its acceleration. A variance of 100 % means that the motion "
        "did not show that entry.",
        f"Of what was learnt at least {_share(min(certificate['memory_trust']))} was used on every axis. No weight "
        f"exceeds {_number(certificate['memory_bound'])}.",
    ]
    if "inertia" in certificate:
        estimates = zip(certificate["inertia"], certificate["inertia_error"], strict=True)
        ratios = ", ".join(
            f"{ratio:.2f} +- {error:.2f}" if error < 1 else f"{ratio:.2f} (nothing found)" for ratio, error in estimates
        )
        sentences.append(f"Inertia of each axis over that of the nominal model, by probing: {ratios}.")
    return RunTable("What the memory learnt", ("axis", "entry", "weight", "variance left"), rows, tuple(sentences))


def fault_rows(faults: Sequence[Mapping[str, Any]], inputs: Sequence[str]) -> RunTable:
    """Faults of a run, as its scenario has them, thrusters by their names: those of the inputs."""
    seconds = lambda value: f"{value:g} s" if isinstance(value, int | float) else f"{value[0]:g} to {value[1]:g} s"
    rows: list[tuple[str | float, ...]] = []
    for fault in faults:
        target = fault["target"]
        number = fault.get("number", "")
        if target == "thruster" and isinstance(number, int):
            number = inputs[number - 1]
        target = f"{target} {number}".rstrip()
        severity, duration = fault.get("severity", "-"), fault.get("duration")
        rows.append(
            (
                target,
                fault["mode"],
                str(severity),
                seconds(fault["onset"]),
                seconds(duration) if duration else "to the end",
            )
        )
    return RunTable("Faults", ("target", "mode", "severity", "onset", "duration"), rows)


def navigation_rows(navigated: Mapping[str, Any]) -> RunTable:
    """What the navigation filter assumed of each sensor, its innovations, and whether it was as accurate as it said."""
    listed = lambda values: ", ".join(dict.fromkeys(f"{value:.3g}" for value in values)) or "-"
    times = lambda sensor: ", ".join(
        dict.fromkeys("constant" if time is None else f"{time:.3g}" for time in sensor["correlation_time"])
    )
    rows: list[tuple[str | float, ...]] = [
        (
            sensor["sensor"],
            listed(sensor["noise"]),
            listed(sensor["correlated"]),
            times(sensor) or "-",
            sensor["innovation_rms"],
            sensor["innovation_correlation"],
            _share(sensor["inconsistent"]),
        )
        for sensor in navigated["sensors"]
    ]
    head = ("sensor", "noise", "correlated error", "over (s)", "innovations", "correlation", "inconsistent for")
    nees = navigated["nees"]
    nees_words = "is not known before the steady window" if nees is None else f"is {nees:.3g}"
    sentences = (
        f"NEES, the normalised estimation error squared of position, velocity and attitude, {nees_words}; 9 is "
        "expected.",
        "Noise and correlated errors are the standard deviations that the filter assumed, in the units of the "
        "readings. Innovations are the rms of normalised ones and the correlation of successive ones over 30 s, at "
        "worst or, where they are consistent, at the end; 1 and 0 are as assumed. A constant error that no other "
        "sensor contradicts is in none of them.",
        *(f"{finding}." for finding in navigated["findings"]),
    )
    return RunTable("Navigation filter", head, rows, sentences)


def transition_rows(
    transitions: Sequence[SupervisorTransition], losses: Sequence[tuple[str, float]] | None = None
) -> RunTable:
    """Transitions of the supervisor: when, to which state, and why; below it the thrusters that it took out of use.

    Args:
        transitions: of the supervisor.
        losses: names of these thrusters, and when, s; None where no monitor watched them.
    """
    sentences = [f"The supervisor took {name} out of use at {time:.6g} s." for name, time in losses or ()]
    if losses is not None and not losses and any(transition.reason in _TRACKING for transition in transitions):
        sentences.append(_NOTHING_FOUND)
    rows: list[tuple[str | float, ...]] = [
        (f"{transition.time:.6g} s", transition.state.name, transition.why()) for transition in transitions
    ]
    return RunTable("Supervision", ("time", "state", "reason: value, limit"), rows, tuple(sentences))


def _span(window: tuple[float, float] | None) -> str:
    return "steady window" if window is None else f"{window[0]:g} to {window[1]:g} s"


def _consequences(certificate: Mapping[str, Any]) -> tuple[str, ...]:
    """The quantities of the proof, as sentences."""
    rising = certificate["rising"]
    sentences = [
        f"{certificate['function']}: {_number(certificate['start'])} at the start, {_number(certificate['end'])} at "
        f"the end; rises at {_share(rising['whole'])} of the steps, {_share(rising['steady'])} of the steady ones."
    ]
    if certificate.get("decay") is not None:
        sentences.append(
            f"Mean of 1/2 E^T Q E over the steady window: {_number(certificate['decay'])}; with tanh for sign (Remark "
            f"5) the proof allows a residual of {_number(certificate['residual'])}."
        )
    if "estimation_within" in certificate:
        within, bounds = certificate["estimation_within"], certificate["estimation_bound"]
        moving = "|d_dot| of what the memory does not explain" if "memory" in certificate else "|d_dot|"
        sentences.append(
            f"|d_hat - d| is within the bound that follows from the largest recorded {moving} (up to "
            f"{_number(None if None in bounds else max(bounds))}) for {_share(within['steady'])} of the steady window."
        )
    return tuple(sentences)


def _share(value: float | None) -> str:
    """A share in percent; 100 and 0 only where they are exact."""
    if value is None:
        return "-"
    if 0 < value < 1:
        return f"{min(max(100 * value, 0.1), 99.9):.1f} %"
    return f"{100 * value:.0f} %"


def _measured(value: float | None, unit: str) -> str | float:
    """A metric as people read it, or the word for an infinite one, which is null in a result file."""
    return infinite(unit) if value is None or isinf(value) else display_units(value, unit)[0]


def plain(value: str | float) -> str:
    """A cell as plain text: numbers in four digits."""
    return value if isinstance(value, str) else f"{value:.4g}"


def _number(value: float | None) -> str:
    """A number of the certificate; a dash for one that is not finite, which is null in a result file."""
    return "-" if value is None else plain(value)
