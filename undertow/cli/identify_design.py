"""`undertow identify-design`: the next experiment, as a script with limits."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from undertow.cli.exit_codes import DONE, warn_of
from undertow.cli.identify import priors_of
from undertow.cli.interruptible import interruptible
from undertow.cli.options.identify_design import IdentifyDesignCommand
from undertow.cli.results_folder import output_folder, results_folder
from undertow.cli.stages import live_stages
from undertow.cli.tables import numbers, print_lines, titled, wide_console
from undertow.core.json_text import to_json
from undertow.core.number_text import plain
from undertow.report.answers.design_answer import answer_of_design
from undertow.report.answers.identification_answer import in_words
from undertow.report.experiment_page import write_design
from undertow.scenario.build import build
from undertow.scenario.reading import read
from undertow.scenario.scenario_vehicle import with_reference
from undertow.studies.identification.design import design
from undertow.studies.identification.design_data import design_data, write_experiment
from undertow.studies.identification.design_result import DesignRequest

_WRITTEN = ("experiment.json", "experiment.yaml", "experiment.csv", "figures", "experiment.html")


def identify_design(command: IdentifyDesignCommand) -> int:
    """Design an experiment and write it to `out`, or to a free folder under runs/."""
    console = wide_console()
    request = DesignRequest(
        room=command.room,
        duration=command.duration,
        of_interest=tuple(command.of_interest or ()),
        free=tuple(command.free or ()),
        priors=priors_of(command.prior or ()),
        depth=command.depth,
        max_rate=command.max_rate,
        max_angle=command.max_angle,
        max_input=command.max_input,
    )
    with (
        output_folder(command.out, Path("runs") / f"{command.scenario.stem}-experiment") as folder,
        results_folder(folder, _WRITTEN, "experiment.json", command.overwrite) as draft,
        live_stages(console) as say,
    ):
        built = build(with_reference(read(command.scenario, allow_code=command.allow_code)))
        result = interruptible(lambda: design(built, request, say))
        data = design_data(result)
        (draft.path / "experiment.json").write_text(to_json(data, indent=1) + "\n", encoding="utf-8")
        write_experiment(result, draft.path)
        failures = write_design(command.scenario.stem, result, data, draft.path, folder)
    warn_of(failures)
    if command.details:
        console.print(_table(data))
    print_lines(console, [*answer_of_design(data, folder).text, f"Page: {folder / 'experiment.html'}"])
    return DONE


def _table(data: Mapping[str, Any]):
    columns = ("file", "deviation before", "after", "left, %")
    table = titled("Deviations to expect", "parameter", *map(numbers, columns), "unit")
    for name, parameter in data["parameters"].items():
        cells = (plain(parameter[key]) for key in ("value", "before", "after"))
        left = f"{100 * parameter['deviation_left']:.0f}"
        table.add_row(in_words(name), *cells, left, parameter["unit"])
    return table
