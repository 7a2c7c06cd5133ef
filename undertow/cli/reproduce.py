"""`undertow reproduce`: reproduce the paper."""

import json
from pathlib import Path

from undertow.cli.interruptible import interruptible
from undertow.cli.pdf_option import check_pdf
from undertow.cli.results_folder import output_folder, results_folder
from undertow.cli.stages import shares
from undertow.cli.tables import wide_console
from undertow.report.reproduction.report import write
from undertow.reproduction import reproduce as study

_WRITTEN = ("report.html", "ablations.html", "results.json", "figures", "runs", "scenarios", "campaigns")


def reproduce(out: Path, quick: bool, pdf: str | None) -> None:
    """Write the report to `out`, with PDF figures of a width where one is given, and print its verdicts."""
    check_pdf(pdf)
    console = wide_console()
    with (
        output_folder(out, out) as folder,
        results_folder(folder, _WRITTEN, "results.json", overwrite=True) as draft,
        shares(console) as progress,
    ):
        found = interruptible(lambda: study.reproduce(draft.path, quick, progress))
        progress("figures and report", 0.9)
        draft.publish()  # before the figures, which may fail
        page = interruptible(lambda: write(found, draft.path, pdf))
    for claim in json.loads((out / "results.json").read_text(encoding="utf-8"))["claims"]:
        line = f"{claim['id']:<4}{claim['verdict']}: {claim['claim']}"
        console.print(line, markup=False, highlight=False, soft_wrap=True)
    console.print(f"Report: {folder / page.relative_to(draft.path)}", highlight=False, soft_wrap=True)
