"""Figures of a comparison: paired differences, time histories of the error, and distributions of the metrics."""

from collections.abc import Callable

import numpy as np
import xarray as xr
from matplotlib.figure import Figure

from undertow.analysis.metrics import for_people, output_groups, titled_name
from undertow.core.status import Status
from undertow.report.figures import style
from undertow.report.figures.campaign import beside, distributions_figure, key_height, looks_of
from undertow.report.figures.limits import fit_log
from undertow.report.figures.pareto import pareto_figure
from undertow.report.figures.paths import PLANE, plan_figure
from undertow.studies.comparison.findings import Findings

_COLUMNS = 3
_BAND = (0.05, 0.95)


def comparison_plots(dataset: xr.Dataset, found: Findings) -> dict[str, Callable[[], Figure]]:
    """Functions that make the figures of a comparison, by name; those for which there is something to show."""
    plots: dict[str, Callable[[], Figure]] = {}
    if _differing(dataset, found):
        plots["differences"] = lambda: differences_figure(dataset, found)
    if found.fronts:
        plots["pareto"] = lambda: pareto_figure(found)
    if "series:error" in dataset:
        plots["histories"] = lambda: histories_figure(dataset, found)
        if set(PLANE) <= set(map(str, dataset["axis"].values)):
            plots["plan"] = lambda: plan_figure(dataset, found)
    if not found.all_equal and len(alike(dataset, found)) < len(found.medians):
        plots["distributions"] = lambda: _distributions(dataset, found)
    return plots


def alike(dataset: xr.Dataset, found: Findings) -> dict[str, float]:
    """Metrics that are the same in every completed trial of every controller, and their value; no figure shows them."""
    same = {}
    for metric in found.medians:
        values = np.concatenate([_values(dataset, found, metric, name) for name in found.names])
        values = values[~np.isnan(values)]
        if values.size and (values == values[0]).all():
            same[metric] = float(values[0])
    return same


def _differing(dataset: xr.Dataset, found: Findings) -> list[str]:
    """Metrics with pairs to compare with the first controller, that differ in some trial of some controller."""
    paired, same = (
        {one.metric for one in found.differences if one.baseline == found.names[0] and one.pairs},
        alike(dataset, found),
    )
    return [metric for metric in found.units if metric in paired and metric not in same]


def differences_figure(dataset: xr.Dataset, found: Findings) -> Figure:
    """Difference of each candidate from the first one: a point per pair, and the median with its 95 % interval."""
    first, *others = found.names
    shown = _differing(dataset, found)
    rows, tall = -(-len(shown) // _COLUMNS), 0.35 + 0.3 * len(others)
    left = min(2.4, 0.3 + 0.068 * max(map(len, others)))
    figure = style.blank(9.6, 0.45 + rows * (tall + 0.75))
    style.head(figure, f"Paired differences from {first}", {})
    chance = np.random.default_rng(0)
    wide = (9.5 - left) / _COLUMNS
    for i, metric in enumerate(shown):
        row, column = divmod(i, _COLUMNS)
        panel = style.place(figure, left + wide * column, 0.6 + row * (tall + 0.75), wide - 0.3, tall)
        panel.axvline(0.0, color=style.INK, linewidth=0.8)
        for place, name in enumerate(others):
            one = next(one for one in found.against(name, first) if one.metric == metric)
            look, scale = looks_of(found.names)[name], for_people(1.0, found.units[metric])[0]
            apart = scale * (_values(dataset, found, metric, name) - _values(dataset, found, metric, first))
            apart = apart[np.isfinite(apart)]
            beside = place + 0.28 * (chance.random(apart.size) - 0.5)
            panel.plot(apart, beside, ".", color=look.colour, markersize=3, alpha=0.45)
            panel.plot(scale * one.median, place, "D", color=look.colour, markersize=5, markeredgecolor="white")
            panel.plot([scale * one.low, scale * one.high], [place, place], color=look.colour, linewidth=2.2)
        panel.set_ylim(len(others) - 0.4, -0.6)
        panel.set_yticks(range(len(others)), others if column == 0 else [""] * len(others))
        panel.ticklabel_format(axis="x", style="sci", scilimits=(-3, 4))
        panel.xaxis.get_offset_text().set_fontsize(style.TINY)
        unit = for_people(0.0, found.units[metric])[1]
        style.label(panel, ", ".join([titled_name(metric), *([style.power(unit)] if unit else [])]))
        panel.xaxis.set_label_coords(0.5, -0.32 / tall)
    return figure


def histories_figure(dataset: xr.Dataset, found: Findings) -> Figure:
    """Error per axis over time, position and attitude apart: the first trial, and the range of all.

    The root of the mean square over the axes: the rms of this curve over a window is the metric of that window.
    """
    units = dataset["axis"].attrs["unit_of_each"].split(", ")
    groups = output_groups(units) or {"tracking": ("", list(range(len(units))))}
    looks, height = looks_of(found.names), 2.0
    key = key_height(looks)
    figure = style.blank(9.6, 0.5 + key + (height + 0.55) * len(groups))
    style.head(figure, "Tracking error per axis: first trial (line), 5 % to 95 % of all trials (area)", {})
    style.key(figure, looks, 0.3, beside(looks))
    time = dataset["time"].values
    for row, (group, (unit, axes)) in enumerate(groups.items()):
        panel = style.place(figure, 0.72, 0.55 + key + row * (height + 0.55), 8.7, height)
        lines = []
        for i, (name, look) in enumerate(looks.items()):
            rows = dataset.isel({found.dimension: i})
            sizes = np.sqrt((rows["series:error"].values[..., axes] ** 2).mean(-1))
            sizes = for_people(1.0, unit)[0] * np.where(time <= rows["ended"].values[:, None], sizes, np.nan)
            some = ~np.isnan(sizes).all(axis=0)
            if len(sizes) > 1:
                low, high = np.nanquantile(sizes[:, some], _BAND, axis=0)
                panel.fill_between(time[some], low, high, color=look.colour, alpha=0.16, linewidth=0)
            panel.plot(time, sizes[0], **look.line)
            lines.append((name, time, sizes[0]))
        fit_log(panel, lines, 0.0)
        panel.set_xlim(time[0], time[-1])
        style.label(panel, "time, s", f"{group} error per axis, {for_people(0.0, unit)[1]}")
    return figure


def _distributions(dataset: xr.Dataset, found: Findings) -> Figure:
    """Empirical CDFs of the metrics that have them."""
    same = alike(dataset, found)
    values = {
        metric: {
            name: each[np.isfinite(each)] for name in found.names for each in [_values(dataset, found, metric, name)]
        }
        for metric in found.units
        if metric not in same
    }
    values = {metric: each for metric, each in values.items() if any(one.size for one in each.values())}
    units = {metric: for_people(1.0, unit) for metric, unit in found.units.items()}
    scaled = {metric: {name: units[metric][0] * one for name, one in each.items()} for metric, each in values.items()}
    counts = dict.fromkeys(found.names, found.trials)
    return distributions_figure(scaled, counts, {metric: unit for metric, (_, unit) in units.items()})


def _values(dataset: xr.Dataset, found: Findings, metric: str, name: str) -> np.ndarray:
    """A metric of one candidate in every trial; NaN where it failed."""
    rows = dataset.isel({found.dimension: found.names.index(name)})
    return np.where(rows["status"].values == int(Status.OK), rows[metric].values, np.nan)
