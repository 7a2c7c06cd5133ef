"""Figure: state and series-parallel state on every axis, and their difference."""

import xarray as xr
from matplotlib.figure import Figure

from undertow.report.figures import signals, style
from undertow.report.figures.multiples import Block, small_multiples

STATE, MODEL = style.SOLID, style.DASHED._replace(width=1.3, order=4)
APART = style.Look("#555555", "-", 0.9, 3)


def identification(title: str, run: xr.Dataset) -> Figure:
    """Fig. 11."""
    state = signals.curve(run, "state $x$", "position", STATE)
    model = signals.curve(run, r"series-parallel state $\hat{x}$", "predicted_position", MODEL)
    apart = signals.difference(run, r"$\hat{x} - x$", "predicted_position", "position", APART)
    apart = apart._replace(values=1000 * apart.values)
    thousandths = [text.replace(", ", ", m") for text in signals.per_axis(run, r"$\hat{x} - x$")]
    return small_multiples(
        title,
        signals.axis_names(run),
        [
            Block([state, model], signals.places(run), height=1.1, titled=True),
            Block([apart], thousandths, height=0.9),
        ],
    )
