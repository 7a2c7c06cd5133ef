"""The predicted metrics of a run, compared with the measured ones."""

from collections.abc import Callable
from concurrent.futures import Future, ThreadPoolExecutor
from typing import Any, NamedTuple, TypeVar

from undertow.analysis.linearization.response import Comparison, compare
from undertow.core.user_code import python_says
from undertow.prediction.operating_point import operating_point, predicted
from undertow.scenario.build import Built, in_its_precision
from undertow.scenario.execute import Executed

Result = TypeVar("Result")

# A measured metric that departs from the predicted one by more than this share is reported.
_DEPARTS = 0.10

# Peak metrics depend on single moments: shown, not compared.
_PEAKS = ("position_max", "attitude_max", "tracking_max", "input_peak")

# Measured numbers below this share of the largest predicted one count as zero.
_NOTHING = 1e-9


class PredictedMetrics(NamedTuple):
    """Metrics of the steady window from the linearised loop, or the reason why there are none."""

    metrics: dict[str, float] | None
    why_not: str


def with_prediction(work: Callable[[], Result], built: Built, enabled: bool) -> tuple[Result, PredictedMetrics | None]:
    """Run `work`, and predict the scenario meanwhile in another thread: compiling takes most of the time of both."""
    if not enabled:
        return work(), None
    with ThreadPoolExecutor(1) as other:
        predicting: Future[PredictedMetrics] = other.submit(_predict, built)
        return work(), predicting.result()


def departures(predicted: PredictedMetrics, executed: Executed) -> list[Comparison]:
    """Metrics that depart by more than a tenth from the predicted ones."""
    return [one for one in _compared(predicted, executed) if one.name not in _PEAKS and one.departure > _DEPARTS]


def comparison(predicted: PredictedMetrics, executed: Executed) -> str:
    """One sentence that compares the run with its prediction."""
    if predicted.metrics is None:
        return f"No prediction: {predicted.why_not}"
    if executed.steady is None:
        return "The prediction is for the steady window, which the run did not reach"
    departing = departures(predicted, executed)
    if not departing:
        return "The run agrees with the prediction: no metric departs by more than 10 %"
    named = ", ".join(f"{one.name} by {one.departure:.0%}" for one in departing)
    return f"The run departs from the linear prediction by more than 10 %: {named}{_because(executed.steady)}"


def in_results(predicted: PredictedMetrics | None) -> dict[str, Any]:
    """Entries of metrics.json."""
    if predicted is None:
        return {}
    return {"predicted": predicted.metrics} | ({"not_predicted": predicted.why_not} if predicted.why_not else {})


@in_its_precision
def _predict(built: Built) -> PredictedMetrics:
    try:
        return PredictedMetrics(*predicted(operating_point(built)))
    except Exception as error:  # a user's part may run and yet not be differentiable
        return PredictedMetrics(None, f"this loop cannot be linearised: {python_says(error)}")


def _compared(predicted: PredictedMetrics, executed: Executed) -> list[Comparison]:
    if predicted.metrics is None or executed.steady is None:
        return []
    largest = max(predicted.metrics.values())
    return [one for one in compare(predicted.metrics, executed.steady) if one.measured > _NOTHING * largest]


def _because(steady: dict[str, Any]) -> str:
    limited = steady.get("saturated_fraction", 0.0)
    if limited > 0:
        return f". Actuators were saturated {limited:.1%} of the time, which the linear model does not capture"
    return ". Nonlinear effects matter here: large motions, dead zones, or motors far from their mean speed"
