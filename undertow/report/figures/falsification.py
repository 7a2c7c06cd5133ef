"""Figures of a falsification: the search, and the failing run beside the nominal one."""

from collections.abc import Mapping
from typing import Any

import numpy as np
import xarray as xr
from matplotlib.figure import Figure

from undertow.analysis.metrics import output_groups
from undertow.report.figures import style

_TALL, _GAP = 1.3, 0.65  # height of a panel and space under it, in
_CUT = 3.0  # least robustness that is shown: runs that failed have any


def search_figure(results: Mapping[str, Any]) -> Figure:
    """Robustness of every run, and where each number that varies was tried, against the number of runs.

    Args:
        results: contents of falsify.json.
    """
    vary = results["vary"]
    robustness = np.array(results["evaluations"]["robustness"], dtype=float)
    figure = style.blank(6.4, 0.4 + (1 + len(vary)) * (_TALL + _GAP))
    style.head(figure, "Search for a violation", {})
    runs = np.arange(1, len(robustness) + 1)
    broken = robustness <= 0
    panels = [("robustness", np.clip(robustness, -_CUT, _CUT), None)]
    panels += [(key, np.array(results["evaluations"]["values"][key]), vary[key]) for key in vary]
    for number, (name, values, bounds) in enumerate(panels):
        panel = style.place(figure, 0.8, 0.5 + number * (_TALL + _GAP), 5.3, _TALL)
        looks = ((~broken, "o", style.MEASURED.colour, "kept"), (broken, "x", style.DASHED.colour, "violated"))
        for mask, mark, colour, word in looks:
            panel.plot(runs[mask], values[mask], mark, color=colour, markersize=2.5, label=word, zorder=3)
        if bounds is None:
            panel.axhline(0.0, **style.TRUTH.line)
            panel.legend(fontsize=style.SMALL, frameon=False, loc="lower right", bbox_to_anchor=(1.0, 1.0), ncols=2)
        else:
            panel.axhline(bounds["nominal"], **style.TRUTH.line)
            if results["counterexample"] is not None:
                panel.axhline(results["counterexample"]["values"][name], **style.SOLID.line)
        style.label(panel, "runs", "", name)
    return figure


def beside_nominal_figure(nominal: xr.Dataset, broken: xr.Dataset) -> Figure:
    """Tracking error per group of outputs and largest input of the failing run beside the nominal one.

    Args:
        nominal, broken: their datasets.
    """
    units = [unit.strip() for unit in nominal["axis"].attrs["unit_of_each"].split(",")]
    groups = output_groups(units)
    figure = style.blank(6.4, 0.4 + (1 + len(groups)) * (_TALL + _GAP))
    style.head(figure, "Counter-example beside the nominal run", {"nominal": style.SOLID, "failing": style.DASHED})
    blocks: list[tuple[str, str, list[int] | None]] = [
        (f"{name} error, {unit}", "error", axes) for name, (unit, axes) in groups.items()
    ]
    blocks.append((f"largest input, {nominal['input'].attrs.get('units', '')}", "input", None))
    for number, (title, name, entries) in enumerate(blocks):
        panel = style.place(figure, 0.8, 0.5 + number * (_TALL + _GAP), 5.3, _TALL)
        for run, look in ((nominal, style.SOLID), (broken, style.DASHED)):
            is_valid = run["time"].values <= run.attrs["ended"]
            values = run[name].values[is_valid]
            size = np.abs(values).max(-1) if entries is None else np.sqrt((values[:, entries] ** 2).sum(-1))
            panel.plot(run["time"].values[is_valid], size, **look.line)
        panel.set_xlim(0, float(nominal["time"][-1]))
        style.label(panel, "time, s", "", title)
    return figure
