"""Figures of a comparison: paired differences, time histories of the error, and distributions of the metrics."""

from collections.abc import Callable

import numpy as np
import xarray as xr
from matplotlib.figure import Figure

from undertow.analysis.metrics import output_groups, titled_name
from undertow.core.number_text import display_units
from undertow.core.status import Status
from undertow.report.figures import style
from undertow.report.figures.campaign import beside, distributions_figure, key_height, looks_of
from undertow.report.figures.limits import fit_log
from undertow.report.figures.pareto import pareto_figure
from undertow.report.figures.paths import PLANE, plan_figure
from undertow.studies.comparison.findings import Findings

_COLUMNS = 3
_BAND = (0.05, 0.95)


def comparison_plots(dataset: xr.Dataset, findings: Findings) -> dict[str, Callable[[], Figure]]:
    """Functions that make the figures of a comparison, by name; those for which there is something to show."""
    plots: dict[str, Callable[[], Figure]] = {}
    if _differing(dataset, findings):
        plots["differences"] = lambda: differences_figure(dataset, findings)
    if findings.fronts:
        plots["pareto"] = lambda: pareto_figure(findings)
    if "series:error" in dataset:
        plots["histories"] = lambda: histories_figure(dataset, findings)
        if set(PLANE) <= set(map(str, dataset["axis"].values)):
            plots["plan"] = lambda: plan_figure(dataset, findings)
    if not findings.all_equal and len(alike(dataset, findings)) < len(findings.medians):
        plots["distributions"] = lambda: _distributions(dataset, findings)
    return plots


def alike(dataset: xr.Dataset, findings: Findings) -> dict[str, float]:
    """Metrics that are the same in every completed trial of every controller, and their value; no figure shows them."""
    constant_metrics = {}
    for metric in findings.medians:
        values = np.concatenate([_values(dataset, findings, metric, name) for name in findings.names])
        values = values[~np.isnan(values)]
        if values.size and (values == values[0]).all():
            constant_metrics[metric] = float(values[0])
    return constant_metrics


def _differing(dataset: xr.Dataset, findings: Findings) -> list[str]:
    """Metrics with pairs to compare with the first controller, that differ in some trial of some controller."""
    first = findings.names[0]
    paired = {
        difference.metric for difference in findings.differences if difference.baseline == first and difference.pairs
    }
    constant_metrics = alike(dataset, findings)
    return [metric for metric in findings.units if metric in paired and metric not in constant_metrics]


def differences_figure(dataset: xr.Dataset, findings: Findings) -> Figure:
    """Difference of each candidate from the first one: a point per pair, and the median with its 95 % interval."""
    first, *candidates = findings.names
    metrics = _differing(dataset, findings)
    rows = -(-len(metrics) // _COLUMNS)
    panel_height = 0.35 + 0.3 * len(candidates)
    left = min(2.4, 0.3 + 0.068 * max(map(len, candidates)))
    figure = style.blank(9.6, 0.45 + rows * (panel_height + 0.75))
    style.head(figure, f"Paired differences from {first}", {})
    chance = np.random.default_rng(0)
    panel_width = (9.5 - left) / _COLUMNS
    for i, metric in enumerate(metrics):
        row, column = divmod(i, _COLUMNS)
        panel = style.place(
            figure, left + panel_width * column, 0.6 + row * (panel_height + 0.75), panel_width - 0.3, panel_height
        )
        panel.axvline(0.0, color=style.INK, linewidth=0.8)
        for position, name in enumerate(candidates):
            difference = next(difference for difference in findings.against(name, first) if difference.metric == metric)
            look = looks_of(findings.names)[name]
            scale = display_units(1.0, findings.units[metric])[0]
            differences = scale * (_values(dataset, findings, metric, name) - _values(dataset, findings, metric, first))
            differences = differences[np.isfinite(differences)]
            jittered = position + 0.28 * (chance.random(differences.size) - 0.5)
            panel.plot(differences, jittered, ".", color=look.colour, markersize=3, alpha=0.45)
            median = scale * difference.median
            panel.plot(median, position, "D", color=look.colour, markersize=5, markeredgecolor="white")
            interval = [scale * difference.low, scale * difference.high]
            panel.plot(interval, [position, position], color=look.colour, linewidth=2.2)
        panel.set_ylim(len(candidates) - 0.4, -0.6)
        panel.set_yticks(range(len(candidates)), candidates if column == 0 else [""] * len(candidates))
        panel.ticklabel_format(axis="x", style="sci", scilimits=(-3, 4))
        panel.xaxis.get_offset_text().set_fontsize(style.TINY)
        unit = display_units(0.0, findings.units[metric])[1]
        style.label(panel, ", ".join([titled_name(metric), *([style.power(unit)] if unit else [])]))
        panel.xaxis.set_label_coords(0.5, -0.32 / panel_height)
    return figure


def histories_figure(dataset: xr.Dataset, findings: Findings) -> Figure:
    """Error per axis over time, position and attitude apart: the first trial, and the range of all.

    The root of the mean square over the axes: the rms of this curve over a window is the metric of that window.
    """
    units = dataset["axis"].attrs["unit_of_each"].split(", ")
    groups = output_groups(units) or {"tracking": ("", list(range(len(units))))}
    looks = looks_of(findings.names)
    height = 2.0
    key = key_height(looks)
    figure = style.blank(9.6, 0.5 + key + (height + 0.55) * len(groups))
    style.head(figure, "Tracking error per axis: first trial (line), 5 % to 95 % of all trials (area)", {})
    style.key(figure, looks, 0.3, beside(looks))
    time = dataset["time"].values
    for row, (group, (unit, axes)) in enumerate(groups.items()):
        panel = style.place(figure, 0.72, 0.55 + key + row * (height + 0.55), 8.7, height)
        lines = []
        for i, (name, look) in enumerate(looks.items()):
            rows = dataset.isel({findings.dimension: i})
            sizes = np.sqrt((rows["series:error"].values[..., axes] ** 2).mean(-1))
            sizes = display_units(1.0, unit)[0] * np.where(time <= rows["ended"].values[:, None], sizes, np.nan)
            running = ~np.isnan(sizes).all(axis=0)
            if len(sizes) > 1:
                low, high = np.nanquantile(sizes[:, running], _BAND, axis=0)
                panel.fill_between(time[running], low, high, color=look.colour, alpha=0.16, linewidth=0)
            panel.plot(time, sizes[0], **look.line)
            lines.append((name, time, sizes[0]))
        fit_log(panel, lines, 0.0)
        panel.set_xlim(time[0], time[-1])
        style.label(panel, "time, s", f"{group} error per axis, {display_units(0.0, unit)[1]}")
    return figure


def _distributions(dataset: xr.Dataset, findings: Findings) -> Figure:
    """Empirical CDFs of the metrics that have them."""
    constant_metrics = alike(dataset, findings)
    units = {metric: display_units(1.0, unit) for metric, unit in findings.units.items()}
    scaled = {}
    for metric in findings.units:
        if metric in constant_metrics:
            continue
        by_candidate = {name: _values(dataset, findings, metric, name) for name in findings.names}
        finite = {name: values[np.isfinite(values)] for name, values in by_candidate.items()}
        if any(values.size for values in finite.values()):
            factor = units[metric][0]
            scaled[metric] = {name: factor * values for name, values in finite.items()}
    counts = dict.fromkeys(findings.names, findings.trials)
    return distributions_figure(scaled, counts, {metric: unit for metric, (_, unit) in units.items()})


def _values(dataset: xr.Dataset, findings: Findings, metric: str, name: str) -> np.ndarray:
    """A metric of one candidate in every trial; NaN where it failed."""
    rows = dataset.isel({findings.dimension: findings.names.index(name)})
    return np.where(rows["status"].values == int(Status.OK), rows[metric].values, np.nan)
