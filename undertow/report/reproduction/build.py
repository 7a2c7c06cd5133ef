"""From what `undertow reproduce` found out to its figures and its page."""

from pathlib import Path
from typing import Any

from matplotlib.figure import Figure

from undertow.report.figures import fidelity_figure, paper_figures, sweep_figure
from undertow.report.figures.ablations import ablations_figure
from undertow.report.figures.drifting import drifting_figure
from undertow.report.figures.horizons import horizons_figure
from undertow.report.figures.lags import lags_figure
from undertow.report.figures.robust_fidelity import robust_fidelity_figure
from undertow.report.reproduction.report import write_report
from undertow.reproduction.reproduce import Reproduction


def write(found: Reproduction, folder: Path) -> Path:
    """Write `report.html` and `figures/`; returns the page.

    Raises:
        OSError: the folder cannot be written.
    """
    return write_report(found.results, draw(found), folder)


def draw(found: Reproduction) -> dict[str, Figure]:
    """Every figure of the report, by name."""
    numbers = {claim["id"]: claim["numbers"] for claim in found.results["claims"]}
    compared = found.results["fidelity"]
    figures = paper_figures(found.datasets("ideal"), found.datasets("static"), found.response) | {
        "fidelity": fidelity_figure(compared, {fidelity: found.datasets(fidelity) for fidelity in compared}),
        "sweep": sweep_figure(numbers["C6"]["sweep"]),
        "horizons": horizons_figure(found.results["horizons"]["rows"], found.results["horizons"]["duration"]),
        "lags": lags_figure(found.results["lags"], found.results["horizons"]["windows"]),
        "drifting": drifting_figure(found.results["drifting"]),
    }
    robust = found.results.get("robust_variant")
    return figures | _of_last_chapter(found, robust) if robust else figures


def _of_last_chapter(found: Reproduction, robust: dict[str, Any]) -> dict[str, Figure]:
    rows = robust["fidelity"]
    datasets = {(row["place"], row["law"]): found.runs[Path(row["scenario"]).stem].dataset for row in rows}
    return {
        "robust_fidelity": robust_fidelity_figure(rows, datasets),
        "ablations": ablations_figure(robust["ablations"]),
    }
