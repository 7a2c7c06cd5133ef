"""From what `undertow reproduce` found out to its figures and its page."""

from pathlib import Path
from typing import Any

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
    figures = paper_figures(found.datasets(1), found.datasets(2), found.response)
    ladder = found.results["ladder"]
    runs = {rung: {name: found.runs[f"{rung}_{name}"].dataset for name in entries} for rung, entries in ladder.items()}
    figures["ladder"] = ladder_figure(ladder, runs)
    sweep = _sweep(found.results)
    return figures | ({"sweep": sweep_figure(sweep)} if sweep else {})


def _sweep(results: dict[str, Any]) -> dict[str, Any]:
    """The frequencies of claim C6."""
    numbers = next((claim["numbers"] for claim in results["claims"] if claim["id"] == "C6"), None)
    if numbers is None:
        return {}
    points = {"frequency": numbers["frequency"], "measured": numbers["error_ratio"]}
    theory = {"theory_frequency": numbers["frequency"], "theory": numbers["error_ratio_predicted"]}
    return {"rcafc": points | theory}
