"""Figures of one run: their files, which its page shows as well."""

from collections.abc import Mapping, Sequence
from typing import Any

import xarray as xr
from matplotlib.figure import Figure

from undertow.report.figures.run import run_plots
from undertow.report.figures.writing import make_all, pdf, small_png
from undertow.report.plotted import Plotted


def plot_run(
    series: xr.Dataset,
    faults: Sequence[Mapping[str, Any]],
    certificate: Mapping[str, Any] | None,
    width: str | None = None,
) -> Plotted:
    """Figures of a run, each plotted once. A failed figure affects neither the others nor the results.

    Args:
        series: recorded ones.
        faults, certificate: as of `run_figures`.
        width: of PDF files; None for none.
    """
    files: dict[str, bytes] = {}
    pictures: dict[str, bytes] = {}

    def put(name: str, figure: Figure) -> None:
        picture = small_png(figure)
        document = {} if width is None else {f"{name}.pdf": pdf(figure, width)}
        pictures[name] = picture
        files.update({f"{name}.png": picture} | document)

    failures = make_all(lambda: run_plots(series, faults, certificate), put)
    return Plotted(files, pictures, failures)
