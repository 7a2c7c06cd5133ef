"""`undertow reproduce`: the paper, whole."""

import json
from pathlib import Path

from rich.console import Console

from undertow.cli.results_folder import results_folder
from undertow.cli.stages import shares
from undertow.cli.tables import wide_console
from undertow.report.reproduction import write
from undertow.studies.paper import reproduce as study

_WRITTEN = ("report.html", "results.json", "figures", "runs", "scenarios")


def reproduce(out: Path, quick: bool) -> None:
    """Write the report to `out` and print its verdicts."""
    console = wide_console()
    with results_folder(out, _WRITTEN, "results.json", overwrite=True) as staging:
        report = out / _watched(console, staging, quick).relative_to(staging)
    for line in _verdicts(out / "results.json"):
        console.print(line, markup=False, highlight=False, soft_wrap=True)
    console.print(f"Report: {report}", highlight=False, soft_wrap=True)


def _watched(console: Console, folder: Path, quick: bool) -> Path:
    with shares(console) as progress:
        found = study.reproduce(folder, quick, progress)
        progress("drawing", 0.9)
        return write(found, folder)


def _verdicts(results: Path) -> list[str]:
    if not results.is_file():
        return []
    claims = json.loads(results.read_text(encoding="utf-8")).get("claims", [])
    return [f"{claim['id']:<4}{claim['verdict']}: {claim['claim']}" for claim in claims]
