"""Writes figures as SVG, PNG and PDF files, with the same bytes for the same figure."""

import io
import re
import threading
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import NamedTuple

import matplotlib
import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.backends.backend_svg import FigureCanvasSVG
from matplotlib.figure import Figure
from PIL import Image

from undertow.core.atomic_io import write_whole
from undertow.core.user_code import python_says
from undertow.report.figures.one_column import one_column

DOTS_PER_INCH = 150
_COLOURS = 48  # of a small PNG: lines, their shades towards the background, and text

# By default matplotlib salts names inside an SVG at random. Only settings that are read while writing may be set here:
# another thread may be making a figure at the same time.
_SETTINGS = {"svg.hashsalt": "undertow", "svg.fonttype": "path", "pdf.fonttype": 42}
_WRITING = threading.Lock()

_PATH = re.compile(r'( d=")([^"]+)(")')
_DIGITS = re.compile(r"(?<=\.\d\d)\d+")


Plots = Mapping[str, Callable[[], Figure]]  # functions that make the figures, by name


class Saved(NamedTuple):
    """The figures written, and a sentence for each failed one."""

    vectors: dict[str, Path]  # .svg, by name
    failures: list[str]


def svg(figure: Figure) -> str:
    """The figure as SVG, without date, with text as outlines (equal on every machine)."""
    text = io.StringIO()
    with _WRITING, matplotlib.rc_context(_SETTINGS):  # pyright: ignore[reportArgumentType] - keys of Matplotlib
        FigureCanvasSVG(figure).print_svg(text, metadata={"Date": None, "Creator": "undertow"})
    # A hundredth of a point is finer than any printer; further digits would be most of the file.
    return _PATH.sub(lambda m: m[1] + _DIGITS.sub("", m[2]) + m[3], text.getvalue())


def png(figure: Figure) -> bytes:
    """The figure as PNG, 150 dots per inch."""
    data = io.BytesIO()
    with _WRITING, matplotlib.rc_context(_SETTINGS):  # pyright: ignore[reportArgumentType] - keys of Matplotlib
        canvas = FigureCanvasAgg(figure)
        before = figure.dpi
        figure.dpi = DOTS_PER_INCH
        canvas.print_png(data, metadata={"Software": "undertow"}, pil_kwargs={"compress_level": 3})
        figure.dpi = before
    return data.getvalue()


def small_png(figure: Figure) -> bytes:
    """The figure as PNG of few colours, 150 dots per inch: a fourth of the bytes of `png`, for pages."""
    with _WRITING, matplotlib.rc_context(_SETTINGS):  # pyright: ignore[reportArgumentType] - keys of Matplotlib
        canvas = FigureCanvasAgg(figure)
        before = figure.dpi
        figure.dpi = DOTS_PER_INCH
        canvas.draw()
        image = Image.fromarray(np.asarray(canvas.buffer_rgba())[..., :3])
        figure.dpi = before
    data = io.BytesIO()
    quantized = image.quantize(_COLOURS, method=Image.Quantize.MAXCOVERAGE, dither=Image.Dither.NONE)
    quantized.save(data, "PNG", compress_level=6)
    return data.getvalue()


def pdf(figure: Figure, width: str) -> bytes:
    """The figure as PDF, without date, with text as TrueType fonts. That of one column is rearranged itself."""
    from matplotlib.backends.backend_pdf import FigureCanvasPdf

    figure = one_column(figure) if width == "one-column" else figure
    data = io.BytesIO()
    with _WRITING, matplotlib.rc_context(_SETTINGS):  # pyright: ignore[reportArgumentType] - keys of Matplotlib
        FigureCanvasPdf(figure).print_pdf(data, metadata={"CreationDate": None, "Creator": "undertow"})
    return data.getvalue()


def files_of(figure: Figure, name: str, width: str | None = None) -> dict[str, bytes]:
    """The files of a figure by their names: `name.svg` and `name.png`, and `name.pdf` where a width is given.

    A PDF of one column rearranges the figure itself.
    """
    files = {f"{name}.svg": svg(figure).encode(), f"{name}.png": png(figure)}
    if width is not None:
        files[f"{name}.pdf"] = pdf(figure, width)
    return files


def save(figure: Figure, folder: Path, name: str, width: str | None = None) -> tuple[Path, Path]:
    """Write `name.svg` and `name.png` into a folder, which is made if need be; and `name.pdf` where a width is given.

    Raises:
        OSError: the folder cannot be written.
    """
    folder.mkdir(parents=True, exist_ok=True)
    for file, data in files_of(figure, name, width).items():
        write_whole(folder / file, data)
    return folder / f"{name}.svg", folder / f"{name}.png"


def make_all(plots: Callable[[], Plots], put: Callable[[str, Figure], None]) -> list[str]:
    """Make figures one by one. A failed figure affects neither the others nor the results.

    Args:
        plots: gives the functions that make the figures, by name.
        put: receives the name and the figure.

    Returns:
        A sentence for each failed figure.
    """
    failures: list[str] = []
    try:
        makers = plots()
    except Exception as error:  # matplotlib and xarray raise many kinds of errors for unusual numbers
        return [f"the figures could not be made ({python_says(error)}); the results are complete"]
    for name, make in makers.items():
        try:
            put(name, make())
        except Exception as error:
            failures.append(f"figure `{name}` could not be made ({python_says(error)}); the results are complete")
    return failures


def save_all(plots: Callable[[], Plots], folder: Path, width: str | None = None) -> Saved:
    """Make and write figures. A failed figure affects neither the others nor the results.

    Args:
        plots: gives the functions that make the figures, by name.
        folder: created if missing.
        width: of PDF files; None for none.
    """
    vectors: dict[str, Path] = {}

    def put(name: str, figure: Figure) -> None:
        vectors[name], _ = save(figure, folder, name, width)

    failures = make_all(plots, put)
    return Saved(vectors, failures)
