"""Figures of an identification: measured and predicted motion, and intervals of the parameters."""

from collections.abc import Mapping
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from undertow.report.answers.identification_answer import in_words
from undertow.report.figures import style

_AXES = {
    "u": "surge, m/s",
    "v": "sway, m/s",
    "w": "heave, m/s",
    "p": "roll, rad/s",
    "q": "pitch, rad/s",
    "r": "yaw, rad/s",
}
_WIDTH = 6.4  # in
_ROW = 0.17  # in, of a parameter
_LEAST = 0.05  # smallest ratio that is shown
# Ratios with a tick, for wide and narrow ranges: the first of these with three or more inside is taken.
_TICKS = (
    (0.05, 0.1, 0.2, 0.5, 1, 2, 5, 10, 20),
    (0.4, 0.5, 0.6, 0.8, 1, 1.2, 1.5, 2, 2.5),
    (0.8, 0.9, 1, 1.1, 1.2),
    (0.9, 0.95, 1, 1.05, 1.1),
)
_COLOURS = {"determined": style.SOLID.colour, "partly": style.DASHED.colour, "unknown": style.MEASURED.colour}


Series = tuple[np.ndarray, np.ndarray, np.ndarray]  # time, measured, predicted


def free_run_figure(series: Mapping[str, Series], fits: Mapping[str, float]) -> Figure:
    """Measured velocities of a dive that was left out, and those of a free run of the identified model.

    Args:
        series: by axis (u ... r): time (s), measured, predicted.
        fits: by axis, %.
    """
    height, gap, top = 0.75, 0.22, 0.45  # in
    figure = style.blank(_WIDTH, top + len(series) * (height + gap) + 0.35)
    style.head(figure, "Free run over a dive not used", {"measured": style.TRUTH, "predicted": style.SOLID})
    for i, (axis, (time, measured, predicted)) in enumerate(series.items()):
        panel = style.place(figure, 0.75, top + i * (height + gap), 4.9, height)
        panel.plot(time, predicted, **style.SOLID.line)
        panel.plot(time, measured, **style.TRUTH.line)
        panel.set_xlim(float(time[0]), float(time[-1]))
        panel.text(1.02, 0.5, f"{fits[axis]:.0f} %", transform=panel.transAxes, va="center", fontsize=style.TEXT)
        is_last = i == len(series) - 1
        style.label(panel, "time, s" if is_last else "", _AXES[axis])
        if not is_last:
            panel.set_xticklabels([])
    return figure


def intervals_figure(parameters: Mapping[str, Mapping[str, Any]]) -> Figure:
    """Estimates with their 95 % intervals, as ratios to the values of the file, or in deviations where these are 0."""
    rows = {name: _relative(parameter) for name, parameter in parameters.items() if parameter["prior"]}
    height = _ROW * len(rows)
    figure = style.blank(_WIDTH, 0.4 + height + 0.45)
    style.head(figure, "Estimates beside the vehicle file", {})
    panel = style.place(figure, 2.0, 0.4, 4.2, height)
    for i, (name, (low, value, high)) in enumerate(rows.items()):
        colour = _COLOURS[parameters[name]["verdict"]]
        panel.plot([low, high], [-i, -i], color=colour, linewidth=1.5, solid_capstyle="butt")
        panel.plot(value, -i, "o", color=colour, markersize=3.5)
    panel.axvline(1.0, color=style.INK, linewidth=0.6, zorder=0)
    ends = np.array(list(rows.values()))
    low, high = max(_LEAST, 0.8 * float(ends.min())), min(1 / _LEAST, 1.25 * float(ends.max()))
    panel.set_xscale("log")
    panel.set_xlim(low, high)
    inside = [[tick for tick in choice if low <= tick <= high] for choice in _TICKS]
    ticks = next((choice for choice in inside if len(choice) > 2), inside[-1])
    panel.set_xticks(ticks, [f"{tick:g}" for tick in ticks])
    panel.minorticks_off()
    panel.set_yticks([-i for i in range(len(rows))], [in_words(name) for name in rows])
    panel.set_ylim(0.5 - len(rows), 0.5)
    style.label(panel, "estimate / value of the file, with its 95 % interval")
    return figure


def _relative(parameter: Mapping[str, Any]) -> tuple[float, float, float]:
    low, value, high = (parameter[key] / parameter["prior"] for key in ("low", "value", "high"))
    low, high = min(low, high), max(low, high)
    return max(low, 1e-3), max(value, 1e-3), max(high, 1e-3)
