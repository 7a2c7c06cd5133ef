"""What `simulate` adds when the results are written: figures, page, and the prediction beside the run."""

import contextlib
from collections.abc import Mapping
from concurrent.futures import Future
from pathlib import Path
from typing import Any, NamedTuple

from rich.console import Console

from undertow.analysis.linearization.response import compare_metrics
from undertow.analysis.theory import theory_of
from undertow.cli.exit_codes import warn_of
from undertow.cli.results_folder import Draft
from undertow.cli.stages import stage
from undertow.cli.tables import terminal_table
from undertow.core.errors import BadInput
from undertow.core.user_code import python_says
from undertow.logs.mcap_writer import write_mcap
from undertow.logs.run_log import log_of_run
from undertow.physics.plants.hybrid_vehicle import HybridVehicle
from undertow.report.plotted import Plotted
from undertow.report.plotting import PlottingProcess
from undertow.report.replay.replay_data import ReplayData, hull_size
from undertow.report.run_page import RunPageContents, page_contents, write_run_page
from undertow.report.run_tables import departure_words, prediction_rows
from undertow.scenario.build import Built, in_its_precision
from undertow.scenario.results.netcdf import write_metrics
from undertow.scenario.results.run_result import ScenarioResult
from undertow.studies.prediction.foregone import reason_without_prediction
from undertow.studies.prediction.operating_point import instability, operating_point, predicted

# A measured metric that departs from the predicted one by more than this share is reported.
_DEPARTS = 0.10

# Peak metrics depend on single moments: shown, not compared.
_PEAKS = ("position_max", "attitude_max", "tracking_max", "input_peak")

# Measured numbers below this share of the largest predicted one count as zero.
_NOTHING = 1e-9
# Below it, in the run and in the prediction, a number matters to nobody: m, rad, their rates, V.
_NEGLIGIBLE = 1e-5


class PredictedMetrics(NamedTuple):
    """Metrics of the steady window from the linearised loop, or the reason why there are none."""

    metrics: dict[str, float] | None
    why_not: str
    foregone: bool = False  # known before anything was linearised
    instability: str = ""  # a sentence where small errors grow


class RequestedPrediction(NamedTuple):
    """The prediction beside a run.

    Attributes:
        coming: predicts the metrics; None for no prediction.
        requested: whether the user asked for it: the reason is printed as well where there can be none.
        details: whether its table is printed.
    """

    coming: Future[PredictedMetrics] | None
    requested: bool
    details: bool


def write_outputs(
    result: ScenarioResult,
    plotting: PlottingProcess,
    prediction: RequestedPrediction,
    draft: Draft,
    folder: Path,
    console: Console,
) -> ReplayData | None:
    """Write log, figures, page and prediction of a run.

    Args:
        result: of the run.
        plotting: plots its figures.
        prediction: of its metrics.
        draft: of the results.
        folder: of the results, as the user knows it.
        console: for what is printed.

    Returns:
        The replay, for a recording; None for a plant that is no vehicle.
    """
    page = draft.path / "run.html"
    with stage(console, "figures and page"):
        looks = page_contents(result, lambda: _written(result, plotting, draft))
        warn_of(looks.failures)
        write_run_page(page, result, looks)
    draft.publish()  # nobody waits for the prediction, which is added to the page
    console.print(f"Page: {folder / 'run.html'}", highlight=False, soft_wrap=True)
    _add_prediction(result, prediction, draft, looks, console)
    return looks.replay


def _add_prediction(
    result: ScenarioResult, prediction: RequestedPrediction, draft: Draft, looks: RunPageContents, console: Console
) -> None:
    """Add the prediction to the results and print it; nothing is printed where there can be none, unless asked for."""
    predicting = prediction.coming
    if predicting is None:
        return
    foregone = predicting.done() and predicting.result().foregone
    with contextlib.nullcontext() if foregone else stage(console, "prediction"):
        predicted = predicting.result()
    write_metrics(result, draft.path, in_results(predicted))
    if predicted.metrics is not None:
        write_run_page(draft.path / "run.html", result, looks, predicted.metrics)
    draft.publish()
    if prediction.requested or not foregone:
        _print_prediction(predicted, prediction.details, result, console)


def _written(result: ScenarioResult, plotting: PlottingProcess, draft: Draft) -> Plotted:
    """The figures, once their files are written; meanwhile the log, because another process plots them."""
    plant = result.built.closed_loop.plant
    size = hull_size(plant.vehicle, result.facts.hull).tolist() if isinstance(plant, HybridVehicle) else None
    write_mcap(log_of_run(result.dataset), draft.path / "run.mcap", size)
    plotted = plotting.plotted()
    plotted.write(draft.path / "figures")
    return plotted


def comparison(predicted: PredictedMetrics, result: ScenarioResult) -> str:
    """One sentence that compares the run with its prediction."""
    if predicted.metrics is None:
        return f"No prediction: {predicted.why_not}"
    assert result.steady is not None  # or there were no prediction
    zero = _NOTHING * max(predicted.metrics.values())
    metrics = [
        metric
        for metric in compare_metrics(predicted.metrics, result.steady)
        if metric.measured > zero and max(metric.measured, metric.predicted) > _NEGLIGIBLE
    ]
    departing = [metric for metric in metrics if metric.name not in _PEAKS and metric.departure > _DEPARTS]
    if not departing:
        return "The run agrees with the prediction: no metric departs by more than 10 %"
    departures = ", ".join(f"{metric.name} {departure_words(metric.departure)}" for metric in departing)
    return (
        f"The run departs from the linear prediction by more than 10 %: {departures}{_because(result, result.steady)}"
    )


def in_results(predicted: PredictedMetrics) -> dict[str, Any]:
    """Entries of metrics.json."""
    return {"predicted": predicted.metrics} | ({"not_predicted": predicted.why_not} if predicted.why_not else {})


def predict(result: ScenarioResult) -> PredictedMetrics:
    """Metrics of the steady window of a run, or the reason why there are none: what takes no time first."""
    why_not = reason_without_prediction(result)
    return PredictedMetrics(None, why_not, foregone=True) if why_not else _linearised(result.built)


@in_its_precision
def _linearised(built: Built) -> PredictedMetrics:
    try:
        op_point = operating_point(built)
        return PredictedMetrics(*predicted(op_point), instability=instability(op_point))
    except BadInput as error:
        return PredictedMetrics(None, str(error))
    except Exception as error:  # a user's part may run and yet not be differentiable
        return PredictedMetrics(None, f"this loop cannot be linearised: {python_says(error)}")


def _because(result: ScenarioResult, steady: Mapping[str, Any]) -> str:
    if theory_of(result.built.of_the_law().closed_loop.controller).at_rest is not None:
        return ". What the law learns is not in the linear model"
    limited = steady.get("saturated_fraction", 0.0)
    if limited > 0:
        return f". Actuators were saturated {limited:.1%} of the time, which the linear model does not capture"
    return ". Nonlinear effects matter here: large motions, dead zones, or motors far from their mean speed"


def _print_prediction(predicted: PredictedMetrics, details: bool, result: ScenarioResult, console: Console) -> None:
    if details and predicted.metrics and result.steady:
        meanings = result.facts.meanings
        metrics = [metric for metric in compare_metrics(predicted.metrics, result.steady) if metric.name in meanings]
        console.print(terminal_table(prediction_rows(metrics, result.built.window(), meanings)))
    console.print(f"{comparison(predicted, result)}.", highlight=False, soft_wrap=True)
