"""`undertow simulate`: run one scenario and write its results and figures."""

import contextlib
from collections.abc import Iterator
from concurrent.futures import Future, ThreadPoolExecutor
from pathlib import Path
from typing import Any, NamedTuple

import typer
from rich.console import Console

from undertow.analysis.linearization.response import compare_metrics
from undertow.checks.vehicle_lint import vehicle_advice
from undertow.cli.exit_codes import DONE, RUN_FAILED, complain, warn_of
from undertow.cli.interruptible import interruptible
from undertow.cli.pdf_option import check_pdf
from undertow.cli.results_folder import output_folder, results_folder
from undertow.cli.stages import shares, stage
from undertow.cli.tables import terminal_table, wide_console
from undertow.core.errors import BadInput
from undertow.core.status import Status
from undertow.core.user_code import python_says
from undertow.prediction.operating_point import operating_point, predicted
from undertow.report.figures import run_plots, save_all
from undertow.report.replay.replay_data import can_be_shown
from undertow.report.replay.video import check_video, write_video
from undertow.report.run_page import shown, write_run_page
from undertow.report.run_tables import certificate_rows, metrics_rows, prediction_rows
from undertow.scenario.build import Built, build, in_its_precision, own_parts
from undertow.scenario.execute import Executed, execute, write, write_metrics
from undertow.scenario.finished_run import Repetition, certificate_of, compare, metrics_of
from undertow.scenario.reading import read

_WRITTEN = ("run.nc", "metrics.json", "scenario.yaml", "figures", "run.html")


class PredictedMetrics(NamedTuple):
    """Metrics of the steady window from the linearised loop, or the reason why there are none."""

    metrics: dict[str, float] | None
    why_not: str


def simulate(
    scenario: Path,
    out: Path | None,
    overwrite: bool,
    prediction: bool,
    allow_code: bool,
    pdf: str | None,
    video: Path | None,
) -> int:
    """Run a scenario and write the results to `out`, or to a free folder under runs/; return the exit code."""
    check_pdf(pdf)
    console = wide_console()
    with (
        output_folder(out, Path("runs") / scenario.stem) as folder,
        results_folder(folder, _WRITTEN, "run.nc", overwrite) as draft,
    ):
        if video is not None:
            check_video(video, folder, overwrite)
        executed = _run(scenario, console, allow_code, video is not None)
        write(executed, draft.path)
        repetition = compare(scenario, executed.dataset) if scenario.suffix == ".nc" else None
        draft.publish()  # the results first: prediction, figures and page take longer, and may fail
        _print_results(executed, folder, console)
        code = max(_ending_code(executed), _repetition_code(repetition, console) if repetition else DONE)
        page = draft.path / "run.html"
        with _predicting(executed.built, prediction) as predicting:
            with stage(console, "figures and page"):
                saved = save_all(lambda: run_plots(executed.dataset), draft.path / "figures", pdf)
                looks = shown(executed.dataset, executed.built.closed_loop, saved)
                warn_of(looks.failures)
                write_run_page(page, executed.dataset, looks)
            draft.publish()  # nobody waits for the prediction, which is added to the page
            console.print(f"Page: {folder / 'run.html'}", highlight=False, soft_wrap=True)
            if predicting is not None:
                with stage(console, "prediction"):
                    predicted = predicting.result()
                write_metrics(executed, draft.path, in_results(predicted))
                write_run_page(page, executed.dataset, looks, predicted.metrics)
                draft.publish()
                _print_prediction(predicted, executed, console)
    if video is not None and looks.replay is not None:
        with shares(console) as progress:
            write_video(looks.replay, video, progress)
    return code


def _run(path: Path, console: Console, allow_code: bool, video: bool) -> Executed:
    with stage(console, "reading"):
        text = read(path, allow_code=allow_code)
    with stage(console, "building"):
        built = build(text)
    if video and not can_be_shown(built.closed_loop.plant):
        raise BadInput("--video", "be left out for a plant that is no vehicle with thrusters", "given")
    for one in (*built.advice(), *vehicle_advice(built)):
        typer.echo(f"Advice: {one.sentence}", err=True)
    with stage(console, "compiling and running"):
        return interruptible(lambda: execute(built))


def _print_results(executed: Executed, folder: Path, console: Console) -> None:
    """Print metrics, certificate and how the run ended."""
    if "left_to_xla" in executed.dataset.attrs:
        why = executed.dataset.attrs["left_to_xla"]
        slower = "the run used backend xla, which is slower than simd (docs/explanation/simd.md)"
        typer.echo(f"Advice: {slower}: {why}.", err=True)
    known, window = metrics_of(executed.dataset), executed.built.window()
    certificate = certificate_of(executed.dataset)
    console.print(terminal_table(metrics_rows(executed.steady, executed.whole, window, known)))
    if certificate is not None:
        console.print(terminal_table(certificate_rows(certificate, window)))
    verdict = f"; {executed.success.sentence(known)}" if executed.success else ""
    console.print(f"Status: {executed.status.word}{verdict}. Results: {folder}", highlight=False, soft_wrap=True)
    own = own_parts(executed.built.scenario, executed.built.text.folder).get("controller")
    if own and (executed.status is not Status.OK or (executed.success and not executed.success.within)):
        typer.echo(f"Advice: for mistakes in the controller, such as a wrong sign: undertow check {own}", err=True)


def _print_prediction(predicted: PredictedMetrics, executed: Executed, console: Console) -> None:
    if predicted.metrics and executed.steady:
        known = metrics_of(executed.dataset)
        compared = [one for one in compare_metrics(predicted.metrics, executed.steady) if one.name in known]
        console.print(terminal_table(prediction_rows(compared, executed.built.window(), known)))
    console.print(f"{comparison(predicted, executed)}.", highlight=False, soft_wrap=True)


def _ending_code(executed: Executed) -> int:
    if executed.status is Status.OK:
        return DONE
    ended, duration = float(executed.outcome.ended), executed.built.scenario.loop.duration
    ending = f"ended as `{executed.status.word}` at {ended:.4g} s of {duration:g} s"
    complain(f"the run {ending}. {executed.dataset.attrs['status_sentence']}")
    return RUN_FAILED


def _repetition_code(repetition: Repetition, console: Console) -> int:
    if repetition.equal or repetition.explained:
        console.print(f"{repetition.sentence}.", highlight=False, soft_wrap=True)
        return DONE
    complain(repetition.sentence)
    return RUN_FAILED


# A measured metric that departs from the predicted one by more than this share is reported.
_DEPARTS = 0.10

# Peak metrics depend on single moments: shown, not compared.
_PEAKS = ("position_max", "attitude_max", "tracking_max", "input_peak")

# Measured numbers below this share of the largest predicted one count as zero.
_NOTHING = 1e-9


@contextlib.contextmanager
def _predicting(built: Built, enabled: bool) -> Iterator[Future[PredictedMetrics] | None]:
    """The prediction of a scenario, made in another thread meanwhile; None where it is left out."""
    if not enabled:
        yield None
        return
    with ThreadPoolExecutor(1) as other:
        yield other.submit(_predict, built)


def comparison(predicted: PredictedMetrics, executed: Executed) -> str:
    """One sentence that compares the run with its prediction."""
    if predicted.metrics is None:
        return f"No prediction: {predicted.why_not}"
    if executed.steady is None:
        return "The prediction is for the steady window, which the run did not reach"
    zero = _NOTHING * max(predicted.metrics.values())
    compared = [one for one in compare_metrics(predicted.metrics, executed.steady) if one.measured > zero]
    departing = [one for one in compared if one.name not in _PEAKS and one.departure > _DEPARTS]
    if not departing:
        return "The run agrees with the prediction: no metric departs by more than 10 %"
    named = ", ".join(f"{one.name} by {100 * one.departure:.0f} %" for one in departing)
    return f"The run departs from the linear prediction by more than 10 %: {named}{_because(executed.steady)}"


def in_results(predicted: PredictedMetrics) -> dict[str, Any]:
    """Entries of metrics.json."""
    return {"predicted": predicted.metrics} | ({"not_predicted": predicted.why_not} if predicted.why_not else {})


@in_its_precision
def _predict(built: Built) -> PredictedMetrics:
    try:
        return PredictedMetrics(*predicted(operating_point(built)))
    except Exception as error:  # a user's part may run and yet not be differentiable
        return PredictedMetrics(None, f"this loop cannot be linearised: {python_says(error)}")


def _because(steady: dict[str, Any]) -> str:
    limited = steady.get("saturated_fraction", 0.0)
    if limited > 0:
        return f". Actuators were saturated {limited:.1%} of the time, which the linear model does not capture"
    return ". Nonlinear effects matter here: large motions, dead zones, or motors far from their mean speed"
