"""What was predicted of a run, beside what came of it."""

from collections.abc import Callable
from concurrent.futures import Future, ThreadPoolExecutor
from typing import Any, NamedTuple, TypeVar

from undertow.analysis.linearization.response import Comparison, compare
from undertow.core.user_code import python_says
from undertow.prediction.operating_point import operating_point, predicted
from undertow.scenario.build import Built, in_its_precision
from undertow.scenario.execute import Executed

Result = TypeVar("Result")

# A measured metric that departs from the predicted one by more than this share is named.
_DEPARTS = 0.10

# Metrics that tell more about the hardest moment than about the law: shown, not judged.
_PEAKS = ("position_max", "attitude_max", "tracking_max", "input_peak")

# Of the wanted: numbers below this share of the largest of their kind are zero.
_NOTHING = 1e-9


class Foresight(NamedTuple):
    """Metrics of the steady window by the linearised loop, or why there are none."""

    metrics: dict[str, float] | None
    why_not: str


def beside(work: Callable[[], Result], built: Built, wanted: bool) -> tuple[Result, Foresight | None]:
    """Result of `work`, and what is predicted of the scenario meanwhile: compiling takes most of the time of both."""
    if not wanted:
        return work(), None
    with ThreadPoolExecutor(1) as other:
        foreseen: Future[Foresight] = other.submit(_foresee, built)
        return work(), foreseen.result()


def departures(predicted: Foresight, executed: Executed) -> list[Comparison]:
    """Metrics that depart by more than a tenth from what was predicted."""
    return [one for one in _compared(predicted, executed) if one.name not in _PEAKS and one.departure > _DEPARTS]


def judgement(predicted: Foresight, executed: Executed) -> str:
    """One sentence on how the run compares with its prediction."""
    if predicted.metrics is None:
        return f"No prediction: {predicted.why_not}"
    if executed.steady is None:
        return "The prediction is for the steady window, which the run did not reach"
    departing = departures(predicted, executed)
    if not departing:
        return "As predicted: no metric departs by more than 10 %"
    named = ", ".join(f"{one.name} by {one.departure:.0%}" for one in departing)
    return f"Departs from the linear prediction by more than 10 %: {named}{_because(executed.steady)}"


def in_results(predicted: Foresight | None) -> dict[str, Any]:
    """What metrics.json says of it."""
    if predicted is None:
        return {}
    return {"predicted": predicted.metrics} | ({"not_predicted": predicted.why_not} if predicted.why_not else {})


@in_its_precision
def _foresee(built: Built) -> Foresight:
    try:
        return Foresight(*predicted(operating_point(built)))
    except Exception as error:  # a part of the user's own may be run, and yet not be differentiated
        return Foresight(None, f"this loop cannot be linearised: {python_says(error)}")


def _compared(predicted: Foresight, executed: Executed) -> list[Comparison]:
    if predicted.metrics is None or executed.steady is None:
        return []
    largest = max(predicted.metrics.values())
    return [one for one in compare(predicted.metrics, executed.steady) if one.measured > _NOTHING * largest]


def _because(steady: dict[str, Any]) -> str:
    limited = steady.get("saturated_fraction", 0.0)
    if limited > 0:
        return f". Inputs were at a limit for {limited:.1%} of the time, which no linear prediction knows"
    return ". What is not linear counts here: large motions, dead zones, motors far from their mean speed"
