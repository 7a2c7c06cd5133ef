"""Figures of one run: their files, and what its page shows of them."""

import io

from PIL import Image

from undertow.report.figures.run import run_plots
from undertow.report.figures.writing import files_of, make_all
from undertow.report.plotted import Plotted
from undertow.scenario.results.run_result import RunRecord

# Bytes above which a figure of two minutes would fill the page as SVG, and colours of the PNG that stands for it.
LARGE, _COLOURS = 80_000, 48


def plot_run(record: RunRecord, width: str | None = None) -> Plotted:
    """Figures of a run. A failed figure affects neither the others nor the results.

    Args:
        record: of the run.
        width: of PDF files; None for none.
    """
    files: dict[str, bytes] = {}
    pictures: dict[str, str | bytes] = {}

    def put(name, figure) -> None:
        files_of_figure = files_of(figure, name, width)
        pictures[name] = _picture(files_of_figure[f"{name}.svg"], files_of_figure[f"{name}.png"])
        files.update(files_of_figure)

    failures = make_all(lambda: run_plots(record.series, record.facts), put)
    return Plotted(files, pictures, failures)


def _picture(vector: bytes, raster: bytes) -> str | bytes:
    """A figure for the page: the SVG, or the PNG in few colours where the SVG is large."""
    if len(vector) <= LARGE:
        return vector.decode()
    data = io.BytesIO()
    with Image.open(io.BytesIO(raster)) as image:
        quantized = image.convert("RGB").quantize(_COLOURS, method=Image.Quantize.MAXCOVERAGE, dither=Image.Dither.NONE)
        quantized.save(data, "PNG", compress_level=6)
    return data.getvalue()
