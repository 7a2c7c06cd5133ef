"""`undertow simulate`: run one scenario and write its results and figures."""

import dataclasses
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import typer
from rich.console import Console

from undertow.cli.exit_codes import DONE, RUN_FAILED, complain
from undertow.cli.interruptible import interruptible
from undertow.cli.options.simulate import SimulateCommand
from undertow.cli.pdf_option import check_pdf
from undertow.cli.results_folder import output_folder, results_folder
from undertow.cli.run_presentation import RequestedPrediction, predict, write_outputs
from undertow.cli.stages import stage
from undertow.cli.tables import print_lines, terminal_table, wide_console
from undertow.core.status import Status
from undertow.logs.run_log import log_of_run
from undertow.outside.rerun_file import check_rerun, write_rerun
from undertow.report.answers.plain_answer import PlainAnswer
from undertow.report.answers.run_answer import answer_of_run
from undertow.report.plotting import plotting_process
from undertow.report.run_page import shown_of
from undertow.report.run_tables import certificate_rows, metrics_rows, transition_rows
from undertow.report.signal_names import lost_thrusters
from undertow.scenario.build import Built, build, own_parts
from undertow.scenario.checks.flow_stability import flow_advice
from undertow.scenario.checks.vehicle_lint import vehicle_advice
from undertow.scenario.reading import read
from undertow.scenario.results.netcdf import write
from undertow.scenario.results.repetition import Repetition, compare
from undertow.scenario.results.run_result import ScenarioResult
from undertow.scenario.results.run_scenario import run_scenario

_WRITTEN = ("run.nc", "run.mcap", "metrics.json", "scenario.yaml", "figures", "run.html")


def simulate(command: SimulateCommand) -> int:
    """Run a scenario and write the results to `out`, or to a free folder under runs/; return the exit code.

    Without `prediction` (None) there is one where it says something.
    """
    scenario, rerun = command.scenario, command.rerun
    check_pdf(command.pdf)
    console = wide_console()
    with (
        output_folder(command.out, Path("runs") / scenario.stem) as folder,
        results_folder(folder, _WRITTEN, "run.nc", command.overwrite) as draft,
        plotting_process() as plotting,
        ThreadPoolExecutor(1) as thread,
    ):
        if rerun is not None:
            check_rerun(rerun, folder, command.overwrite)
        built, advised = _built(scenario, console, command.allow_code)
        try:
            with stage(console, "compiling and running"):
                result = interruptible(lambda: run_scenario(built))
            plotting.plot(shown_of(result), command.pdf)
            if command.details:
                _print_tables(result, console)
            predicting = None if command.prediction is False else thread.submit(predict, result)
            if predicting is not None and answer_of_run(result).good is False:
                with stage(console, "looking for the reason"):
                    instability = predicting.result().instability
                result = dataclasses.replace(result, facts=result.facts._replace(instability=instability))
            answer = answer_of_run(result)
            _print_answer(answer, result, console)
            write(result, draft.path)
            repetition = compare(scenario, result.dataset) if scenario.suffix == ".nc" else None
            draft.publish()  # the results first: prediction, figures and page take longer, and may fail
            console.print(f"Results: {folder}", highlight=False, soft_wrap=True)
            code = max(_ending_code(result), _repetition_code(repetition, console) if repetition else DONE)
            shown = RequestedPrediction(predicting, bool(command.prediction), command.details)
            if not built.scenario.description:  # a page needs a name; results repeat whatever their file is called
                result = dataclasses.replace(result, facts=result.facts._replace(title=scenario.stem))
            replay = write_outputs(result, plotting, shown, draft, folder, console)
            more = "" if command.details else "; --details prints all numbers"
            hint = f"Next: undertow analyze {scenario} shows the margins of the gains{more}."
            console.print(hint, highlight=False, soft_wrap=True)
            advised += _advice_of(answer, result)
        finally:  # at the end, where people look, also where the run failed
            for sentence in advised:
                typer.echo(f"Advice: {sentence}", err=True)
    if rerun is not None:
        write_rerun(log_of_run(result.dataset), rerun, None if replay is None else replay.size)
    return code


def _built(path: Path, console: Console, allow_code: bool) -> tuple[Built, list[str]]:
    """The scenario, and what is to be said of it."""
    with stage(console, "reading"):
        text = read(path, allow_code=allow_code)
    with stage(console, "building"):
        built = build(text)
    return built, [advice.sentence for advice in (*built.advice(), *vehicle_advice(built), *flow_advice(built))]


def _print_answer(answer: PlainAnswer, result: ScenarioResult, console: Console) -> None:
    """Print how the run ended, and whether it went well."""
    print_lines(console, answer.text)
    for name, verdict in result.facts.requirements.items():
        outcome = "holds" if verdict.holds else "is violated"
        console.print(
            f"Requirement {name} {outcome}: robustness {verdict.robustness:.4g}.", highlight=False, soft_wrap=True
        )


def _print_tables(result: ScenarioResult, console: Console) -> None:
    """Print metrics and certificate."""
    facts, window = result.facts, result.facts.window
    console.print(terminal_table(metrics_rows(facts.steady, facts.whole, window, facts.meanings)))
    if facts.certificate is not None:
        console.print(terminal_table(certificate_rows(facts.certificate, window)))
    if facts.transitions is not None:
        console.print(terminal_table(transition_rows(facts.transitions, lost_thrusters(result.series))))


def _advice_of(answer: PlainAnswer, result: ScenarioResult) -> list[str]:
    """What is to be said of a run beside its answer."""
    facts = result.facts
    advised = [f"{finding}." for finding in (facts.navigation or {"findings": ()})["findings"]]
    if facts.left_to_xla:
        why = facts.left_to_xla
        advised.append(f"the run used backend xla instead of simd (docs/explanation/simd.md): {why}.")
    controller = own_parts(result.built.scenario, result.built.text.folder).get("controller")
    if controller and answer.good is False:
        advised.append(f"for mistakes in the controller, such as a wrong sign: undertow check {controller}")
    return advised


def _ending_code(result: ScenarioResult) -> int:
    if result.status is Status.OK:
        return DONE
    ended = float(result.outcome.ended)
    duration = result.built.scenario.loop.duration
    ending = f"ended as `{result.status.word}` at {ended:.4g} s of {duration:g} s"
    complain(f"the run {ending}. {result.facts.sentence}")
    return RUN_FAILED


def _repetition_code(repetition: Repetition, console: Console) -> int:
    if repetition.equal or repetition.explained:
        console.print(f"{repetition.sentence}.", highlight=False, soft_wrap=True)
        return DONE
    complain(repetition.sentence)
    return RUN_FAILED
