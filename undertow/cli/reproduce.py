"""`undertow reproduce`: reproduce the paper."""

import json

from undertow.cli.interruptible import interruptible
from undertow.cli.options.reproduce import ReproduceCommand
from undertow.cli.pdf_option import check_pdf
from undertow.cli.results_folder import output_folder, results_folder
from undertow.cli.stages import shares
from undertow.cli.tables import wide_console
from undertow.paper.pages.report import write
from undertow.paper.reproduce import reproduce as reproduce_paper
from undertow.simulation.processes import worker_processes

_WRITTEN = ("report.html", "ablations.html", "results.json", "figures", "runs", "scenarios", "campaigns")


def reproduce(command: ReproduceCommand) -> None:
    """Write the report to `out`, with PDF figures of a width where one is given, and print its verdicts."""
    check_pdf(command.pdf)
    console = wide_console()
    with (
        output_folder(command.out, command.out) as folder,
        results_folder(folder, _WRITTEN, "results.json", overwrite=True) as draft,
        shares(console) as progress,
        worker_processes(preload="undertow.paper.reproduce") as pool,
    ):
        reproduction = interruptible(lambda: reproduce_paper(draft.path, command.quick, progress, pool))
        progress("figures and report", 0.9)
        draft.publish()  # before the figures, which may fail
        page = interruptible(lambda: write(reproduction, draft.path, command.pdf, pool))
    for claim in json.loads((command.out / "results.json").read_text(encoding="utf-8"))["claims"]:
        line = f"{claim['id']:<4}{claim['verdict']}: {claim['claim']}"
        console.print(line, highlight=False, soft_wrap=True)
    console.print(f"Report: {folder / page.relative_to(draft.path)}", highlight=False, soft_wrap=True)
