"""Figure of the certificate of a run: Lyapunov function, its rate, the weights, and when limits or projection acted."""

from collections.abc import Iterable, Mapping
from typing import Any

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Patch
from matplotlib.ticker import FixedLocator, NullLocator

from undertow.report.figures import style
from undertow.report.figures.limits import drawable, fit_linear, fit_log

# Narrower than the others, so that it is read without scrolling where a page is narrow.
_WIDTH, _LEFT, _RIGHT, _TOP, _TALL, _GAP, _FOOT = 7.2, 0.66, 0.14, 0.66, 1.5, 0.42, 0.45

# Colour, opacity, and the height as shares of a panel: one as a background, one as a strip along the bottom.
_SPANS = {"input at a limit": ("#e07b00", 0.22, 1.0), "weight at its bound (projection)": ("#009e73", 0.7, 0.07)}

# Decades of dV/dt that are shown on either side of zero.
_DECADES = 4


def certificate_figure(run: xr.Dataset, title: str, bound: float) -> Figure:
    """V and its parts, dV/dt, and the largest weight with its bound, where the controller has weights.

    Spans with active limits are shaded.

    Args:
        run: recorded series.
        title: of the figure.
        bound: largest size that a weight may have; infinite where it may have any.
    """
    valid_run = run.isel(time=run["time"].values <= run.attrs.get("ended", np.inf))
    time = valid_run["time"].values
    values_of = lambda name: np.where(drawable(values := valid_run[name].values), values, np.nan)
    rows = 3 if "weights_peak" in run else 2
    figure = style.blank(_WIDTH, _TOP + rows * _TALL + (rows - 1) * _GAP + _FOOT)
    acting = {"input at a limit": values_of("saturated").max(-1) > 0}
    if "weights_at_bound" in run:
        acting["weight at its bound (projection)"] = values_of("weights_at_bound") > 0
    _head(figure, title, acting)
    panels = [
        style.place(figure, _LEFT, _TOP + row * (_TALL + _GAP), _WIDTH - _LEFT - _RIGHT, _TALL) for row in range(rows)
    ]
    value, rate = values_of("lyapunov"), values_of("lyapunov_rate")
    parts = [("V", value, style.SOLID)]
    if "lyapunov_tracking" in run and "lyapunov_estimation" in run:
        parts.append(("tracking part", values_of("lyapunov_tracking"), style.DASHED))
        parts.append(("estimation part", values_of("lyapunov_estimation"), style.TRUTH))
        if np.array_equal(value, values_of("lyapunov_estimation")):  # then the tracking part is not part of V
            parts = [("V of the estimator", value, style.SOLID), ("tracking, not in V", *parts[1][1:])]
    _plot(panels[0], time, parts)
    fit_log(panels[0], [(name, time, values) for name, values, _ in parts], 0.0)
    style.label(panels[0], "", "V, m$^2$/s$^2$", "Lyapunov function")
    _plot(panels[1], time, [("dV/dt", rate, style.SOLID)], key=False)
    _fit_rate(panels[1], rate)
    style.label(panels[1], "" if rows > 2 else "time, s", "dV/dt, m$^2$/s$^3$", "rate of the Lyapunov function")
    if rows > 2:
        weights = [("largest |$\\theta$|", values_of("weights_peak"), style.SOLID)]
        if np.isfinite(bound):
            weights.append(("bound", np.full(len(time), bound), style.TRUTH))
        _plot(panels[2], time, weights)
        style.label(panels[2], "time, s", "|$\\theta$|, m/s$^2$", "weights")
        fit_linear(panels[2], [(name, time, values) for name, values, _ in weights], 0.0)
    for panel in panels:
        for name, now in acting.items():
            _shade(panel, time, now, name)
        if len(time) > 1:
            panel.set_xlim(time[0], time[-1])
    return figure


def _head(figure: Figure, title: str, acting: Iterable[str]) -> None:
    style.head(figure, title, {})
    patches = [Patch(facecolor=_SPANS[name][0], alpha=_SPANS[name][1], linewidth=0, label=name) for name in acting]
    figure.legend(
        handles=patches,
        loc="upper right",
        bbox_to_anchor=(0.995, 1.0),
        ncols=len(patches),
        fontsize=style.TEXT,
        frameon=False,
    )


def _plot(panel: Axes, time: np.ndarray, curves, key: bool = True) -> None:
    for name, values, look in curves:
        finite_values = np.where(np.isfinite(values), values, np.nan)
        panel.plot(time, finite_values, **look.line, label=name)
    if key:
        panel.legend(
            loc="lower right",
            bbox_to_anchor=(1.0, 1.0),
            ncols=len(curves),
            fontsize=style.SMALL,
            frameon=False,
            borderaxespad=0.0,
            handlelength=2.6,
        )


def _fit_rate(panel: Axes, rate: np.ndarray) -> None:
    """Symmetric logarithmic scale, linear about zero."""
    panel.axhline(0.0, color=style.INK, linewidth=0.8)
    sizes = np.abs(rate[drawable(rate)])
    if not sizes.any():
        return
    top = 10.0 ** np.floor(np.log10(sizes.max()))
    panel.set_yscale("symlog", linthresh=top / 10**_DECADES, linscale=0.5)
    panel.yaxis.set_major_locator(FixedLocator([-top, -top / 100, 0.0, top / 100, top]))
    panel.yaxis.set_minor_locator(NullLocator())


def _shade(panel: Axes, time: np.ndarray, now: np.ndarray, name: str) -> None:
    """Shade the records at which a limit acted, each until the next record."""
    if not now.any():
        return
    colour, alpha, height = _SPANS[name]
    until = np.append(time[1:], time[-1])
    panel.fill_between(
        np.ravel(np.column_stack([time, until])),
        0.0,
        height,
        where=np.repeat(now, 2),
        transform=panel.get_xaxis_transform(),
        facecolor=colour,
        alpha=alpha,
        linewidth=0,
        zorder=0,
    )


def weights_bound(certificate: Mapping[str, Any] | None) -> float:
    """Largest theta_max of any axis of a certificate; infinite where there is none."""
    bounds = (certificate or {}).get("weights_bound", [None])
    return max(np.inf if bound is None else bound for bound in bounds)
