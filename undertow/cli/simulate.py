"""`undertow simulate`: run one scenario and write its results and figures."""

from pathlib import Path

import typer
from rich.console import Console

from undertow.checks.vehicle_findings import vehicle_warnings
from undertow.cli.exit_codes import DONE, RUN_FAILED, complain, warn_of
from undertow.cli.interruptible import interruptible
from undertow.cli.prediction_check import PredictedMetrics, comparison, in_results, with_prediction
from undertow.cli.results_folder import output_folder, results_folder
from undertow.cli.stages import Stages
from undertow.cli.tables import certificate_table, metrics_table, wide_console
from undertow.core.status import Status
from undertow.report.figures import run_plots, save_all
from undertow.scenario.build import build
from undertow.scenario.execute import Executed, execute, save
from undertow.scenario.reading import dump, read
from undertow.scenario.reproducibility import Repetition, compare
from undertow.scenario.results import certificate_of, metrics_of, metrics_text

_WRITTEN = ("run.nc", "metrics.json", "scenario.yaml", "figures")


def simulate(scenario: Path, out: Path | None, overwrite: bool, prediction: bool, allow_code: bool) -> int:
    """Run a scenario and write the results to `out`, or to a free folder under runs/; return the exit code."""
    console = wide_console()
    stages = Stages(console)
    with (
        output_folder(out, Path("runs") / scenario.stem) as folder,
        results_folder(folder, _WRITTEN, "run.nc", overwrite) as draft,
    ):
        executed, predicted = _run(scenario, stages, prediction, allow_code)
        with stages("files and figures"):
            _write(executed, predicted, draft.path)
            repetition = compare(scenario, executed.dataset) if scenario.suffix == ".nc" else None
            draft.publish()  # before the figures, which may fail
            warn_of(save_all(lambda: run_plots(executed.dataset), draft.path / "figures").failures)
    if "left_to_xla" in executed.dataset.attrs:
        why = executed.dataset.attrs["left_to_xla"]
        typer.echo(f"Advice: the run used backend xla, which is slower than simd (docs/simd.md): {why}.", err=True)
    expected = predicted.metrics if predicted else None
    known = metrics_of(executed.dataset)
    console.print(metrics_table(executed.steady, executed.whole, executed.built.window(), known, expected))
    if predicted:
        console.print(f"{comparison(predicted, executed)}.", highlight=False, soft_wrap=True)
    certificate = certificate_of(executed.dataset)
    if certificate is not None:
        console.print(certificate_table(certificate, executed.built.window()))
    verdict = f"; {executed.success.sentence(known)}" if executed.success else ""
    console.print(f"Status: {executed.status.word}{verdict}. Results: {folder}", highlight=False, soft_wrap=True)
    codes = [_ending_code(executed)] + ([_repetition_code(repetition, console)] if repetition else [])
    return max(codes)


def _run(path: Path, stages: Stages, prediction: bool, allow_code: bool) -> tuple[Executed, PredictedMetrics | None]:
    with stages("reading"):
        text = read(path, allow_code=allow_code)
    with stages("building"):
        built = build(text)
    for sentence in (*built.advice(), *vehicle_warnings(built)):
        typer.echo(f"Advice: {sentence}", err=True)
    with stages("compiling, running and predicting" if prediction else "compiling and running"):
        return interruptible(lambda: with_prediction(lambda: execute(built), built, prediction))


def _write(executed: Executed, predicted: PredictedMetrics | None, folder: Path) -> None:
    save(executed.dataset, folder / "run.nc")
    (folder / "metrics.json").write_text(metrics_text(executed.dataset, in_results(predicted)), encoding="utf-8")
    (folder / "scenario.yaml").write_text(dump(executed.built.resolved), encoding="utf-8")


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
