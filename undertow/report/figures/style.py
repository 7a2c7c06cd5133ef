"""The look of all figures. Line styles carry the meaning, so that a grey print shows the same as a screen.

Only matplotlib's objects are used, never pyplot, and no setting of matplotlib is changed: two threads may plot at once.
"""

import re
from typing import Any, NamedTuple

from matplotlib.axes import Axes
from matplotlib.axis import Axis
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.ticker import LogLocator, MaxNLocator, NullLocator
from matplotlib.transforms import ScaledTranslation, Transform

TEXT, SMALL, TINY = 8.0, 7.0, 6.2  # pt
INK, FAINT = "#222222", "#d9d9d9"
STEPS = (1, 2, 2.5, 5, 10)  # between ticks


class Look(NamedTuple):
    """Colour (safe for colour-blind readers, dark or light enough to differ in grey), dashes, width, order."""

    colour: str
    dashes: str | tuple
    width: float
    order: int

    @property
    def line(self) -> dict[str, Any]:
        """Arguments of `Axes.plot` for a line."""
        return {"color": self.colour, "linestyle": self.dashes, "linewidth": self.width, "zorder": self.order}


TRUTH = Look("#000000", (0, (1, 1.8)), 1.1, 4)  # dotted: desired or true
MEASURED = Look("#8c8c8c", "-", 0.8, 1)  # what an estimate is of: a noisy line under it
SOLID = Look("#0072b2", "-", 1.1, 3)  # RCAFC, or what the run did
DASHED = Look("#e07b00", (0, (4, 1.6)), 1.1, 2)  # RAFC, or the second of two
CONTROLLERS = {"rcafc": ("RCAFC", SOLID), "rafc": ("RAFC", DASHED)}
MARKS = {"rcafc": "o", "rafc": "s"}


def blank(width: float, height: float) -> Figure:
    """An empty figure, size in inches."""
    return Figure(figsize=(width, height), facecolor="white")


def place(figure: Figure, left: float, top: float, width: float, height: float) -> Axes:
    """A panel, with its position in inches from the upper left corner."""
    page_width, page_height = figure.get_size_inches()
    panel = figure.add_axes(
        (left / page_width, 1 - (top + height) / page_height, width / page_width, height / page_height)
    )
    panel.tick_params(which="both", left=False, bottom=False, labelsize=SMALL, labelcolor=INK, pad=3)
    panel.grid(True, color=FAINT, linewidth=0.5)
    panel.set_axisbelow(True)
    panel.xaxis.set_major_locator(MaxNLocator(max(2, int(width / 0.4)), steps=STEPS))
    panel.yaxis.set_major_locator(MaxNLocator(4, steps=STEPS))
    for side, spine in panel.spines.items():
        spine.set_visible(side in ("left", "bottom"))
        spine.set_linewidth(0.6)
    return panel


def few_log_ticks(*axes: Axis, most: int = 5) -> None:
    """At most so many labels and no minor ticks on logarithmic axes."""
    for axis in axes:
        axis.set_major_locator(LogLocator(numticks=most))
        axis.set_minor_locator(NullLocator())


def label(panel: Axes, x: str = "", y: str = "", title: str = "", size: float = TEXT, below: float = 0.2) -> None:
    """Axis labels, with units, and a title at the upper left of a panel, at fixed distances from it.

    `below` is that of the x label, in.
    """
    panel.set_xlabel(x, fontsize=SMALL, color=INK)
    panel.set_ylabel(y, fontsize=SMALL, color=INK)
    # Without coordinates of their own the labels would be moved clear of the tick labels: most of the plotting time.
    panel.xaxis.set_label_coords(0.5, 0, transform=_shifted(panel, 0, -below))
    panel.yaxis.set_label_coords(0, 0.5, transform=_shifted(panel, -0.42, 0))
    panel.set_title(title, fontsize=size, color=INK, loc="left", fontweight="bold", y=1, pad=3)


def _shifted(panel: Axes, right: float, up: float) -> Transform:
    """Fractions of the panel, moved by inches."""
    return panel.transAxes + ScaledTranslation(right, up, panel.figure.dpi_scale_trans)


def head(figure: Figure, title: str, keys: dict[str, Look]) -> None:
    """Title at the upper left, key of line styles at the upper right."""
    _, height = figure.get_size_inches()
    figure.text(0.012, 1 - 0.09 / height, title, fontsize=TEXT + 1.5, fontweight="bold", color=INK, va="top")
    if keys:
        _legend(figure, keys, len(keys), loc="upper right", bbox_to_anchor=(0.995, 1.0 - 0.02 / height))


def key(figure: Figure, keys: dict[str, Look], top: float, columns: int) -> None:
    """Key of line styles at the left, `top` inches below the upper edge, for names too long for the head."""
    _, height = figure.get_size_inches()
    _legend(figure, keys, columns, loc="upper left", bbox_to_anchor=(0.005, 1.0 - top / height))


def _legend(figure: Figure, keys: dict[str, Look], columns: int, **placement) -> None:
    figure.legend(
        handles=[
            Line2D([], [], color=k.colour, linestyle=k.dashes, linewidth=1.6, label=name)  # pyright: ignore[reportArgumentType] - dashes as Matplotlib takes them
            for name, k in keys.items()
        ],
        ncols=columns,
        fontsize=TEXT,
        frameon=False,
        handlelength=3.0,
        columnspacing=1.4,
        borderaxespad=0.2,
        **placement,
    )


def note(panel: Axes, text: str, at: tuple[float, float], shift: tuple[float, float], **looks: Any) -> None:
    """A small text near a point, in shares of the panel, moved by points (pt)."""
    settings = {"xycoords": "axes fraction", "textcoords": "offset points", "fontsize": TINY} | looks
    panel.annotate(text, at, xytext=shift, **settings)


def power(unit: str) -> str:
    """A unit, or several, as matplotlib typesets it: m/s^2 with a raised 2."""
    return re.sub(r"\^(\d)", r"$^\1$", unit)
