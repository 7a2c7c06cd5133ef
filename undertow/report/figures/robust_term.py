"""Figure: robust term on every axis, with the second half of the run enlarged."""

from matplotlib.figure import Figure

from undertow.report.figures import signals, style
from undertow.report.figures.multiples import Block, small_multiples
from undertow.report.figures.tracking import Controllers


def robust_term(title: str, runs: Controllers) -> Figure:
    """Fig. 8."""
    first = next(iter(runs.values()))
    looks = [(run, *style.CONTROLLERS[key]) for key, run in runs.items()]
    curves = [signals.curve(run, name, "robust_term", look) for run, name, look in looks]
    end = float(first["time"].values[-1])
    return small_multiples(
        title,
        signals.axis_names(first),
        [
            Block(curves, signals.per_axis(first, "$u_r$", "/s^2"), height=1.05, titled=True),
            Block(curves, signals.per_axis(first, "$u_r$", "/s^2"), height=1.05, window=(end / 2, end)),
        ],
    )
