"""`undertow identify`: the numbers of a vehicle from its logs, and how sure they are."""

import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from rich.table import Table

from undertow.cli.exit_codes import DONE, warn_of
from undertow.cli.interruptible import interruptible
from undertow.cli.options.identify import IdentifyCommand
from undertow.cli.pdf_option import check_pdf
from undertow.cli.results_folder import output_folder, results_folder
from undertow.cli.stages import live_stages
from undertow.cli.tables import numbers, print_lines, titled, wide_console
from undertow.cli.unfinished import checkpoint_in, unfinished
from undertow.core import checks
from undertow.core.errors import BadInput
from undertow.core.json_text import to_json
from undertow.core.number_text import plain
from undertow.report.answers.identification_answer import answer_of_identification, in_words, profile_words
from undertow.report.identification_page import write_identification
from undertow.scenario.build import Built, build
from undertow.scenario.log_file import read_log
from undertow.scenario.provenance import recording_hash, text_hash
from undertow.scenario.reading import dump, read
from undertow.scenario.scenario_vehicle import with_reference
from undertow.scenario.uncertain_number import UncertainNumber, uncertain_number
from undertow.simulation.checkpoint import Checkpoint
from undertow.studies.identification.estimates import METHODS
from undertow.studies.identification.identified_files import write_files
from undertow.studies.identification.identify import identify
from undertow.studies.identification.result_data import as_data

_CHECKPOINT = "identification.jsonl"
_WRITTEN = ("identification.html", "identification.json", "identified.yaml", "vehicle.yaml", "figures")


def identify_vehicle(command: IdentifyCommand) -> int:
    """Identify the vehicle of a scenario and write the results to `out`, or to a free folder under runs/."""
    if command.scenario is None or not command.logs:
        raise BadInput("", "", "identify needs a SCENARIO and the LOGs of its dives, or --thruster with a bench record")
    scenario, log_files, resume = command.scenario, command.logs, command.resume
    check_pdf(command.pdf)
    checks.choice("--method", command.method, METHODS)
    console = wide_console()
    priors = priors_of(command.prior or ())
    first = Path("runs") / f"{scenario.stem}-identified"
    out = unfinished(first, _CHECKPOINT) if resume and command.out is None else command.out
    with (
        output_folder(out, first) as folder,
        results_folder(folder, _WRITTEN, "identification.json", command.overwrite) as draft,
        checkpoint_in(folder, _CHECKPOINT, "identify") as kept,
        live_stages(console) as say,
    ):
        say("reading")
        built = build(with_reference(read(scenario, allow_code=command.allow_code)))
        logs = [read_log(path, command.mapping) for path in log_files]
        unseen = [read_log(path, command.mapping) for path in command.unseen or ()]
        checkpoint = Checkpoint(kept, _fingerprint(command, log_files, built), math.inf, resume, what="identification")
        result = interruptible(
            lambda: identify(
                built,
                logs,
                unseen=unseen,
                free=command.free or (),
                priors=priors,
                per_axis=command.per_axis,
                method=command.method,
                profile=command.profile or (),
                step=command.step,
                segment=command.segment,
                checkpoint=checkpoint,
                say=say,
            )
        )
        data = as_data(result)
        try:
            (draft.path / "identification.json").write_text(to_json(data, indent=1) + "\n", encoding="utf-8")
            write_files(built, result, log_files, draft.path)
            draft.publish()  # before the figures, which may fail
            kept.unlink()
        except OSError:
            console.print(interval_table(data["parameters"], has_prior=True))  # what took minutes is not lost
            raise
        warn_of(write_identification(scenario.stem, result, data, draft.path, folder, command.pdf))
    if command.details:
        console.print(interval_table(data["parameters"], has_prior=True))
    print_lines(console, [*answer_of_identification(data, folder).text, f"Results: {folder}"])
    return DONE


def _fingerprint(command: IdentifyCommand, logs: Sequence[Path], built: Built) -> str:
    """Of what an identification depends on: the vehicle, the contents of the logs, and the options."""
    files = [*logs, *(command.unseen or ()), *([command.mapping] if command.mapping else [])]
    options = (command.free, command.prior, command.per_axis, command.method, command.step, command.segment)
    hashes = [recording_hash(path) for path in files]
    return text_hash(dump({"plant": built.resolved["plant"], "files": hashes, "options": repr(options)}))


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


def interval_table(parameters: Mapping[str, Any], has_prior: bool) -> Table:
    """Parameters of an identification.

    Args:
        parameters: as in identification.json, by name.
        has_prior: whether to show the values of the file.
    """
    shown = {"prior": "file", "value": "estimate", "low": "from", "high": "to"}
    keys = [key for key in shown if has_prior or key != "prior"]
    columns = ("parameter", *map(numbers, (shown[key] for key in keys)), "unit", "")
    has_profiles = any("profile" in parameter for parameter in parameters.values())
    table = titled("Parameters, with 95 % intervals", *columns, *(["by the profile"] if has_profiles else []))
    for name, parameter in parameters.items():
        numbers_of = (plain(parameter[key]) for key in keys)
        profile = [profile_words(parameter)] if has_profiles else []
        table.add_row(in_words(name), *numbers_of, parameter["unit"], parameter["verdict"], *profile)
    return table
