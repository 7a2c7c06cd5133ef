"""Figure: lumped uncertainty and its estimate on every axis, and the estimation error."""

import xarray as xr
from matplotlib.figure import Figure

from undertow.report.figures import signals, style
from undertow.report.figures.multiples import Block, small_multiples
from undertow.report.figures.tracking import Controllers


def uncertainty(title: str, runs: Controllers) -> Figure:
    """Figs. 7 and 12."""
    first = next(iter(runs.values()))
    looks = [(run, *style.CONTROLLERS[key]) for key, run in runs.items()]
    true = signals.curve(first, "true $d$", "uncertainty", style.TRUTH)
    estimates = [signals.curve(run, name, "estimate", look) for run, name, look in looks]
    errors = [signals.difference(run, name, "estimate", "uncertainty", look) for run, name, look in looks]
    start = settled(first)
    rate = "/s^2"
    return small_multiples(
        title,
        signals.axis_names(first),
        [
            Block(
                [true, *estimates],
                signals.per_axis(first, r"$d$, $\hat{d}$", rate),
                height=1.35,
                limits_from=start,
                titled=True,
            ),
            Block(errors, signals.per_axis(first, r"$\hat{d} - d$", rate), height=0.85, limits_from=start),
        ],
    )


def settled(run: xr.Dataset) -> float:
    """Time, s, after which the y axes fit the values: the first twentieth of a run is start-up."""
    return float(run["time"].values[-1]) / 20
