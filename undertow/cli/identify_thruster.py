"""`undertow identify --thruster`: the numbers of a thruster from records of a test bench."""

from collections.abc import Sequence
from pathlib import Path

from undertow.cli.exit_codes import DONE, warn_of
from undertow.cli.identify import interval_table
from undertow.cli.interruptible import interruptible
from undertow.cli.options.identify import IdentifyCommand
from undertow.cli.pdf_option import check_pdf
from undertow.cli.results_folder import output_folder, results_folder
from undertow.cli.stages import live_stages
from undertow.cli.tables import print_lines, wide_console
from undertow.core import checks
from undertow.core.errors import BadInput, error_location
from undertow.core.json_text import to_json
from undertow.core.runtime import in_precision
from undertow.physics.thrusters.thruster import AbstractThruster
from undertow.report.answers.thruster_answer import answer_of_thruster
from undertow.report.thruster_page import write_thruster_page
from undertow.scenario.factory import make
from undertow.studies.identification.bench.bench_reader import read_bench
from undertow.studies.identification.bench.identify_thruster import identify_thruster
from undertow.studies.identification.bench.thruster_file import write_thruster
from undertow.studies.identification.bench.thruster_result import thruster_data

_WRITTEN = ("identification.html", "identification.json", "thruster.yaml", "figures")


def identify_bench(command: IdentifyCommand) -> int:
    """Identify a thruster and write the results to `out`, or to a free folder under runs/."""
    check_pdf(command.pdf)
    console = wide_console()
    files = command.thruster or []
    if command.scenario is not None:
        hint = "Give each further bench record with --thruster"
        raise BadInput("SCENARIO", "be left out with --thruster", str(command.scenario), hint=hint)
    title = files[0].stem
    if command.supply is not None:
        checks.positive("--supply", command.supply, "V")
    with (
        output_folder(command.out, Path("runs") / f"{title}-identified") as folder,
        results_folder(folder, _WRITTEN, "identification.json", command.overwrite) as draft,
        live_stages(console) as say,
    ):
        say("reading")
        tables = [read_bench(file, command.supply, command.mapping) for file in files]
        others = _others(command.compare or ())
        result = interruptible(lambda: identify_thruster(tables, others, say))
        data = thruster_data(result, files)
        (draft.path / "identification.json").write_text(to_json(data, indent=1) + "\n", encoding="utf-8")
        write_thruster(draft.path / "thruster.yaml", data)
        draft.publish()  # before the figures, which may fail
        warn_of(write_thruster_page(title, result, others, data, draft.path, folder, command.pdf))
    if command.details:
        console.print(interval_table(data["forms"][0]["parameters"], has_prior=False))
    print_lines(console, [*answer_of_thruster(data, folder).text, f"Results: {folder}"])
    return DONE


def _others(names: Sequence[str]) -> dict[str, AbstractThruster]:
    """Thrusters of the catalogue by name."""
    others = {}
    for name in names:
        with error_location("--compare"), in_precision("float64"):
            others[name], _ = make("thrusters", name, Path())
    return others
