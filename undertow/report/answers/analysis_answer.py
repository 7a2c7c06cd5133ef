"""The answer of `undertow analyze`: whether the loop is stable, how large errors become, and how much is left."""

from collections.abc import Iterator

import numpy as np

from undertow.report.answers.plain_answer import PlainAnswer
from undertow.report.quantities import quantity
from undertow.studies.prediction.linearized_points import nearest_to_instability
from undertow.studies.prediction.predict import Prediction

_ENOUGH = 0.999  # share of the time in which the actuators give what the loads demand
_GREAT = 100.0  # factor of a gain from which on a margin is as good as any


def answer_of_prediction(prediction: Prediction) -> PlainAnswer:
    """The answer of a prediction."""
    lost = [point.where for point in prediction.points if not point.found]
    unstable = [point.where for point in prediction.points if point.found and point.radius >= 1]
    held = prediction.authority.held >= _ENOUGH
    # Errors and margins are those of a loop that is stable.
    parts = (_actuators,) if unstable or lost else (_errors, _margins, _vehicles, _noise, _actuators)
    lines = tuple(line for part in parts for line in part(prediction))
    good = not lost and not unstable and held and all(vehicle.is_stable for vehicle in prediction.vehicles)
    return PlainAnswer(good, _verdict(prediction, lost, unstable, held), lines)


def _verdict(prediction: Prediction, lost: list[str], unstable: list[str], held: bool) -> str:
    if unstable:
        return f"The closed loop is unstable: {_listed(unstable)}{_swinging(prediction)}."
    if lost:
        return (
            f"There is no equilibrium: {_listed(lost)}. The actuators cannot hold the loads there, or nothing rights "
            "the vehicle about an axis that they do not control. Margins mean nothing before that is mended."
        )
    stable = f"The closed loop is stable at all {len(prediction.points)} operating points"
    if not held:
        return f"{stable}, but the actuators cannot give what the loads demand."
    return f"{stable}, and the actuators give what the loads demand."


def _swinging(prediction: Prediction) -> str:
    """Which output grows, and how."""
    worst = nearest_to_instability(prediction.points)
    swings = abs(worst.pole.imag) > abs(worst.pole.real)
    how = f" and swings with a period of {2 * np.pi / abs(worst.pole.imag):.2g} s" if swings else ""
    return f". An error in {worst.growing} grows by {max(worst.pole.real, 0):.2g} 1/s{how}"


def _listed(places: list[str]) -> str:
    shown = ", ".join(places[:3])
    return shown if len(places) <= 3 else f"{shown}, and {len(places) - 3} more"


def _errors(prediction: Prediction) -> Iterator[str]:
    """Predicted errors of the steady window."""
    if prediction.metrics is None:
        yield f"No errors are predicted: {prediction.why_not}."
        return
    known = prediction.operating_point.built.known_metrics()
    parts = [
        f"{known[key].named(key)} {quantity(prediction.metrics[key], known[key].unit)}"
        for key in ("position_rms", "attitude_rms", "tracking_rms")
        if key in prediction.metrics
    ]
    if parts:
        yield f"Predicted: {'; '.join(parts)}."


def _margins(prediction: Prediction) -> Iterator[str]:
    """How much later, weaker, stronger or slower the loop may be."""
    margins, dt = prediction.margins, prediction.operating_point.linear.dt
    further = [
        f"{_milliseconds(margins[name])} {words}"
        for name, words in (("delay", "of further delay"), ("lag", "of further lag"))
        if np.isfinite(margins[name])
    ]
    if further:
        yield f"It stays stable with up to {' or '.join(further)}."
    least, most = margins["gain_low"], margins["gain_high"]
    bounds = [f"at least {least:.2g}"] if least > 1 / _GREAT else []
    bounds += [f"at most {most:.2g}"] if most < _GREAT else []
    if bounds:
        yield f"Inputs may have {' and '.join(bounds)} times the effect that the model assumes."
    if np.isfinite(margins["sampling_time"]):
        limit = _milliseconds(margins["sampling_time"])
        yield f"These gains need a sampling time below {limit}; it is {_milliseconds(dt)}."


def _vehicles(prediction: Prediction) -> Iterator[str]:
    """How the margins differ between the vehicles that the one of the file may be."""
    count = len(prediction.vehicles)
    if not count:
        return
    unstable = sum(not vehicle.is_stable for vehicle in prediction.vehicles)
    which = f"{count} vehicles within the deviations of the file"
    if unstable:
        yield f"Of {which} {unstable} {'is' if unstable == 1 else 'are'} not stable with these gains."
        return
    delays = [vehicle.margins["delay"] for vehicle in prediction.vehicles]
    smallest, largest = _milliseconds(min(delays)), _milliseconds(max(delays))
    spread = f", with a delay margin of {smallest} to {largest}" if np.isfinite(max(delays)) else ""
    yield f"It is stable with {which}{spread}."


def _milliseconds(seconds: float) -> str:
    return "no time" if seconds == 0 else f"{1e3 * seconds:.2g} ms" if seconds < 0.0995 else f"{seconds:.2g} s"


def _noise(prediction: Prediction) -> Iterator[str]:
    """The noise of measured velocities that the inputs bear."""
    largest = prediction.noise.largest
    if np.isfinite(largest):
        yield (
            f"Noise of the measured velocities of {quantity(largest, 'm')}/s and {quantity(largest, 'rad')}/s (one "
            "standard deviation) drives the inputs to their limits."
        )


def _actuators(prediction: Prediction) -> Iterator[str]:
    """The share of the inputs that loads take."""
    lost = any(not point.found for point in prediction.points)
    used = max((point.used for point in prediction.points if point.found), default=0.0)
    if used:
        yield f"{'Elsewhere the' if lost else 'The'} loads take up to {quantity(used, '')} of an input."
    for sentence in prediction.lost:
        yield f"{sentence[:1].upper()}{sentence[1:]}."
