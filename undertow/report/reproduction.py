"""From what `undertow reproduce` found out to its figures and its page."""

from pathlib import Path

from matplotlib.figure import Figure

from undertow.report.figures import ladder_figure, paper_figures, sweep_figure
from undertow.report.paper_report import write_report
from undertow.studies.paper.reproduce import Reproduction


def write(found: Reproduction, folder: Path) -> Path:
    """Write `report.html` and `figures/`; returns the page.

    Raises:
        OSError: the folder cannot be written.
    """
    return write_report(found.results, draw(found), folder)


def draw(found: Reproduction) -> dict[str, Figure]:
    """Every figure of the report, by name."""
    numbers = {claim["id"]: claim["numbers"] for claim in found.results["claims"]}
    ladder = found.results["ladder"]
    return paper_figures(found.datasets("ideal"), found.datasets("static"), found.response) | {
        "ladder": ladder_figure(ladder, {rung: found.datasets(rung) for rung in ladder}),
        "sweep": sweep_figure(numbers["C6"]["sweep"]),
    }
