"""`undertow reproduce`: reproduce the paper."""

import json
from pathlib import Path

from rich.console import Console

from undertow.cli.interruptible import interruptible
from undertow.cli.results_folder import Draft, output_folder, results_folder
from undertow.cli.stages import shares
from undertow.cli.tables import wide_console
from undertow.report.reproduction.report import write
from undertow.reproduction import reproduce as study

_WRITTEN = ("report.html", "results.json", "figures", "runs", "scenarios", "campaigns")


def reproduce(out: Path, quick: bool) -> None:
    """Write the report to `out` and print its verdicts."""
    console = wide_console()
    with output_folder(out, out) as folder, results_folder(folder, _WRITTEN, "results.json", overwrite=True) as draft:
        report = folder / _watched(console, draft, quick).relative_to(draft.path)
    for line in _verdicts(out / "results.json"):
        console.print(line, markup=False, highlight=False, soft_wrap=True)
    console.print(f"Report: {report}", highlight=False, soft_wrap=True)


def _watched(console: Console, draft: Draft, quick: bool) -> Path:
    with shares(console) as progress:
        found = interruptible(lambda: study.reproduce(draft.path, quick, progress))
        progress("figures and report", 0.9)
        draft.publish()  # before the figures, which may fail
        return interruptible(lambda: write(found, draft.path))


def _verdicts(results: Path) -> list[str]:
    if not results.is_file():
        return []
    claims = json.loads(results.read_text(encoding="utf-8")).get("claims", [])
    return [f"{claim['id']:<4}{claim['verdict']}: {claim['claim']}" for claim in claims]
