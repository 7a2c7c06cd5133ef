"""Figures of a single run, with any number of outputs and inputs, completed or not."""

from collections.abc import Callable

import numpy as np
import xarray as xr
from matplotlib.figure import Figure

from undertow.report.figures import recorded, style
from undertow.report.figures.certificate import certificate_figure, weights_bound
from undertow.report.figures.fault_marks import fault_marks
from undertow.report.figures.limits import early_size
from undertow.report.figures.multiples import Block, Curve, small_multiples
from undertow.report.figures.summary import summary
from undertow.report.plotted import FLOORS, Shown
from undertow.report.signal_names import axis_names, controller_axis_names, input_names

# A failed run is plotted on a symmetric logarithmic scale if its peak is this many times its early size.
_RUNAWAY = 1e2


def run_figures(shown: Shown) -> dict[str, Figure]:
    """Figures `summary`, `tracking`, `error`, `estimate` and `effort` of one run.

    A controller with a certificate adds `certificate`, a measurement with errors adds `measurement`. Faults are marked.

    Args:
        shown: what they show.
    """
    return {name: make() for name, make in run_plots(shown).items()}


def run_plots(shown: Shown) -> dict[str, Callable[[], Figure]]:
    """Functions that make the figures of a run, by name; see `run_figures`."""
    run = shown.series
    outputs = axis_names(run)
    inputs = input_names(run)
    run_in_degrees = recorded.in_degrees(run)
    desired = recorded.curve(run_in_degrees, "desired $x_d$", "reference", style.TRUTH)
    actual = recorded.curve(run_in_degrees, "actual $x$", "position", style.SOLID)
    error = recorded.magnitude(recorded.curve(run_in_degrees, "|$x_d - x$|", "error", style.SOLID))
    true = recorded.curve(run, "true $d$", "uncertainty", style.MEASURED)
    curves = [true]
    if "estimate" in run:
        curves.append(recorded.curve(run, r"estimate $\hat{d}$", "estimate", style.SOLID))
    commanded = recorded.curve(run, "commanded", "commanded_input", style.DASHED)
    applied = recorded.curve(run, "applied", "input", style.SOLID)
    places = recorded.places(run_in_degrees)
    errors = recorded.per_axis(run_in_degrees, "|error|")
    rates = recorded.per_axis(run, "uncertainty", "/s^2")
    levels = recorded.per_input(run, "input")
    marks = fault_marks(run, shown.faults)

    def plot(what: str, names: list[str], blocks: Callable[[], list[Block]]) -> Callable[[], Figure]:
        marked = lambda: [block._replace(marks=marks) for block in blocks()]
        return lambda: small_multiples(_titled(run, what), names, marked(), _columns(len(names)))

    figures = {
        "summary": lambda: summary(shown, _titled(run, "Path, error and effort")),
        "tracking": plot("Tracking", outputs, lambda: [_block(run, [desired, actual], places, 0.0)]),
        "error": plot(
            "Tracking error", outputs, lambda: [_block(run, [error], errors, recorded.settled(run), scale="zero")]
        ),
        "estimate": plot(
            "Lumped uncertainty and its estimate",
            controller_axis_names(run),
            lambda: [_block(run, curves, rates, recorded.settled(run))],
        ),
        "effort": plot("Inputs", inputs, lambda: [_block(run, [commanded, applied], levels, recorded.settled(run))]),
    }
    if "lyapunov" in run:
        bound = weights_bound(shown.certificate)
        figures["certificate"] = lambda: certificate_figure(run, _titled(run, "Certificate"), bound)
    if (run["measured_position"] == run["position"]).all() and (run["measured_velocity"] == run["velocity"]).all():
        return figures
    figures["measurement"] = plot("Measurement error", outputs, lambda: _apart(run))
    return figures


def _apart(run: xr.Dataset) -> list[Block]:
    """Measurement error of position and, below it, velocity."""
    run_in_degrees = recorded.in_degrees(run)
    position = recorded.difference(run_in_degrees, "measured less true", "measured_position", "position", style.SOLID)
    turns = np.array([unit == "deg" for unit in run_in_degrees["axis"].attrs["unit_of_each"].split(", ")])
    position = position._replace(values=np.where(turns, (position.values + 180) % 360 - 180, position.values))
    velocity = recorded.difference(run, "measured less true", "measured_velocity", "velocity", style.SOLID)
    rates = recorded.per_axis(run, r"error of $\dot{x}$", "/s")
    return [
        _block(run, [position], recorded.per_axis(run_in_degrees, "error of $x$"), 0.0),
        _block(run, [velocity], rates, 0.0)._replace(titled=False),
    ]


def _block(run: xr.Dataset, curves: list[Curve], quantities: list[str], start: float, scale: str = "linear") -> Block:
    failed = run.attrs.get("status", "completed") != "completed"
    peaks = [np.nanmax(np.abs(curve.values), initial=0.0) for curve in curves]
    early_peaks = [early_size(curve.time, curve.values) for curve in curves]
    runaway = failed and max(peaks) > _RUNAWAY * max(early_peaks)
    start = 0.0 if failed else start
    spans = _spans(curves, quantities, start)
    scale = "symlog" if runaway else scale
    return Block(curves, quantities, 1.4, scale=scale, spans=spans, limits_from=start, titled=True)


def _spans(curves: list[Curve], quantities: list[str], start: float) -> list[float]:
    """Least span of the axis of each column: that of the widest one of its quantity, and what matters to a vehicle."""
    late = [curve.values[curve.time >= start] for curve in curves]
    widths = np.max([np.nanmax(values, 0, initial=-np.inf) for values in late], 0) - np.min(
        [np.nanmin(values, 0, initial=np.inf) for values in late], 0
    )
    widest: dict[str, float] = {}
    for quantity, width in zip(quantities, widths, strict=True):
        floor = FLOORS.get(quantity.rpartition(", ")[2], 0.0)
        widest[quantity] = max(widest.get(quantity, floor), float(width) if np.isfinite(width) else 0.0)
    return [widest[quantity] for quantity in quantities]


def _titled(run: xr.Dataset, what: str) -> str:
    status = run.attrs.get("status", "completed")
    return what if status == "completed" else f"{what} ({status.replace('_', ' ')} at {run.attrs['ended']:.3g} s)"


def _columns(count: int) -> int:
    """Three columns, or two where that fills the rows better."""
    return 3 if count % 3 == 0 else min(count, 2)
