"""Figures as files: SVG and PNG, the same bytes for the same figure."""

import io
import re
import threading
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import NamedTuple

import matplotlib
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.backends.backend_svg import FigureCanvasSVG
from matplotlib.figure import Figure

from undertow.core.user_code import python_says

DOTS_PER_INCH = 150

# Names inside an SVG are salted at random unless a setting of matplotlib says otherwise; it is held while writing. Only
# settings that are read while writing may stand here: another thread may be making a figure, and would read them too.
_SETTINGS = {"svg.hashsalt": "undertow", "svg.fonttype": "path"}
_WRITING = threading.Lock()

_PATH = re.compile(r'( d=")([^"]+)(")')
_DIGITS = re.compile(r"(\.\d\d)\d+")


Drawings = Mapping[str, Callable[[], Figure]]  # what makes each figure, by name


class Saved(NamedTuple):
    """Figures that were written, and a sentence for each that could not be."""

    vectors: dict[str, Path]  # .svg, by name
    failures: list[str]


def svg(figure: Figure) -> str:
    """The figure as SVG, without date, text drawn as outlines (looks alike everywhere)."""
    text = io.StringIO()
    with _WRITING, matplotlib.rc_context(_SETTINGS):
        FigureCanvasSVG(figure).print_svg(text, metadata={"Date": None, "Creator": "undertow"})
    # A hundredth of a point is finer than any printer: the rest of the digits is most of the file.
    return _PATH.sub(lambda m: m[1] + _DIGITS.sub(r"\1", m[2]) + m[3], text.getvalue())


def png(figure: Figure) -> bytes:
    """The figure as PNG, 150 dots per inch."""
    data = io.BytesIO()
    with _WRITING, matplotlib.rc_context(_SETTINGS):
        canvas = FigureCanvasAgg(figure)
        before = figure.dpi
        figure.dpi = DOTS_PER_INCH
        canvas.print_png(data, metadata={"Software": "undertow"}, pil_kwargs={"compress_level": 3})
        figure.dpi = before
    return data.getvalue()


def save(figure: Figure, folder: Path, name: str) -> tuple[Path, Path]:
    """Write `name.svg` and `name.png` into a folder, which is made if need be.

    Raises:
        OSError: the folder cannot be written.
    """
    folder.mkdir(parents=True, exist_ok=True)
    vector, raster = folder / f"{name}.svg", folder / f"{name}.png"
    vector.write_text(svg(figure), encoding="utf-8")
    raster.write_bytes(png(figure))
    return vector, raster


def save_all(drawings: Callable[[], Drawings], folder: Path) -> Saved:
    """Draw and write figures. One that cannot be drawn costs no other, and none the results that it would show.

    Args:
        drawings: gives what makes each figure, by name.
        folder: made if need be.
    """
    saved = Saved({}, [])
    try:
        makers = drawings()
    except Exception as error:  # whatever matplotlib and xarray say of numbers that nobody thought of
        saved.failures.append(f"no figure could be drawn ({python_says(error)}); the results are whole")
        return saved
    for name, make in makers.items():
        try:
            saved.vectors[name], _ = save(make(), folder, name)
        except Exception as error:
            saved.failures.append(f"figure `{name}` could not be drawn ({python_says(error)}); the results are whole")
    return saved
