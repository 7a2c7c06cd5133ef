"""`undertow identify`: the numbers of a vehicle from its logs, and how sure they are."""

import contextlib
from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

from rich.console import Console
from rich.progress import Progress, SpinnerColumn, TextColumn, TimeElapsedColumn

from undertow.cli.exit_codes import DONE, warn_of
from undertow.cli.interruptible import interruptible
from undertow.cli.options.identify import IdentifyCommand
from undertow.cli.pdf_option import check_pdf
from undertow.cli.results_folder import output_folder, results_folder
from undertow.cli.tables import numbers, print_lines, titled, wide_console
from undertow.core.errors import BadInput
from undertow.core.json_text import to_json
from undertow.core.number_text import plain
from undertow.report.answers.identification_answer import answer_of_identification, in_words
from undertow.report.identification_page import write_identification
from undertow.scenario.build import build
from undertow.scenario.log_file import read_log
from undertow.scenario.reading import read
from undertow.scenario.uncertain_number import UncertainNumber, uncertain_number
from undertow.studies.identification.identified_files import write_files
from undertow.studies.identification.identify import identify
from undertow.studies.identification.result_data import as_data

_WRITTEN = ("identification.html", "identification.json", "identified.yaml", "vehicle.yaml", "figures")


def identify_vehicle(command: IdentifyCommand) -> int:
    """Identify the vehicle of a scenario and write the results to `out`, or to a free folder under runs/."""
    check_pdf(command.pdf)
    console = wide_console()
    priors = priors_of(command.prior or ())
    with (
        output_folder(command.out, Path("runs") / f"{command.scenario.stem}-identified") as folder,
        results_folder(folder, _WRITTEN, "identification.json", command.overwrite) as draft,
        live_stages(console) as say,
    ):
        say("reading")
        logs = [read_log(path, command.mapping) for path in command.logs]
        built = build(read(command.scenario, allow_code=command.allow_code))
        result = interruptible(
            lambda: identify(
                built,
                logs,
                free=command.free or (),
                priors=priors,
                per_axis=command.per_axis,
                step=command.step,
                segment=command.segment,
                say=say,
            )
        )
        data = as_data(result)
        (draft.path / "identification.json").write_text(to_json(data, indent=1) + "\n", encoding="utf-8")
        write_files(built, result, command.logs, draft.path)
        draft.publish()  # before the figures, which may fail
        warn_of(write_identification(command.scenario.stem, result, data, draft.path, folder, command.pdf))
    if command.details:
        console.print(_table(data))
    print_lines(console, [*answer_of_identification(data, folder).text, f"Results: {folder}"])
    return DONE


def priors_of(words: Sequence[str]) -> dict[str, UncertainNumber]:
    """Priors as a user writes them: `mass=11.5+-0.2`.

    Raises:
        BadInput: a word of another form.
    """
    priors = {}
    for word in words:
        name, _, text = word.partition("=")
        prior = uncertain_number("--prior", text)
        if prior is None:
            raise BadInput("--prior", "be NAME=VALUE+-DEVIATION, such as mass=11.5+-0.2", word)
        priors[name.strip()] = prior
    return priors


@contextlib.contextmanager
def live_stages(console: Console) -> Iterator[Callable[[str], None]]:
    """Show the current stage and the time."""
    columns = (SpinnerColumn(), TextColumn("{task.description}"), TimeElapsedColumn())
    with Progress(*columns, console=console, transient=True, disable=not console.is_terminal) as live:
        task = live.add_task("starting")

        def say(stage: str) -> None:
            live.update(task, description=stage)
            if not console.is_terminal:
                console.print(stage, highlight=False)

        yield say


def _table(data: Mapping[str, Any]):
    table = titled(
        "Parameters, with 95 % intervals", "parameter", *map(numbers, ("file", "estimate", "from", "to")), "unit", ""
    )
    for name, parameter in data["parameters"].items():
        cells = (plain(parameter[key]) for key in ("prior", "value", "low", "high"))
        table.add_row(in_words(name), *cells, parameter["unit"], parameter["verdict"])
    return table
