"""Figure: desired and actual position on every axis, and the size of the error."""

from collections.abc import Mapping

import xarray as xr
from matplotlib.figure import Figure

from undertow.report.figures import signals, style
from undertow.report.figures.multiples import Block, small_multiples

Controllers = Mapping[str, xr.Dataset]  # rcafc, rafc or both


def tracking(title: str, runs: Controllers) -> Figure:
    """Figs. 6 and 10."""
    first = next(iter(runs.values()))
    looks = [(run, *style.CONTROLLERS[key]) for key, run in runs.items()]
    desired = signals.curve(first, "desired $x_d$", "reference", style.TRUTH)
    actual = [signals.curve(run, name, "position", look) for run, name, look in looks]
    errors = [signals.magnitude(signals.curve(run, name, "error", look)) for run, name, look in looks]
    return small_multiples(
        title,
        signals.axis_names(first),
        [
            Block([desired, *actual], signals.places(first), height=1.1, titled=True),
            Block(errors, signals.per_axis(first, "|error|"), height=1.0, scale="log"),
        ],
    )
