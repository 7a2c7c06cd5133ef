"""Figures of `undertow analyze`: poles, frequency responses and actuator authority."""

from collections.abc import Callable
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from undertow.core.contracts import AbstractPlant
from undertow.report.figures import style
from undertow.simulation.loop.dataset import input_names
from undertow.studies.prediction.predict import Prediction

_MARKS = ("o", "s", "^", "D")
_COLOURS = ("#0072b2", "#e07b00", "#009e73", "#cc79a7", "#56b4e9", "#7a5c00")
_FORWARD, _REVERSE = style.Look(style.INK, "-", 1.4, 3), style.Look(style.INK, (0, (4, 1.6)), 1.4, 3)
_DASHES = ("-", (0, (4, 1.6)), (0, (1, 1.2)), (0, (6, 1.5, 1, 1.5)), (0, (2, 1)), (0, (8, 2)))


def prediction_plots(prediction: Prediction) -> dict[str, Callable[[], Figure]]:
    """Functions that make the figures, by name: poles, frequency, actuators (where inputs have limits)."""
    figures = {"poles": lambda: _poles(prediction), "frequency": lambda: _frequency(prediction)}
    if np.isfinite(prediction.authority.high).any():
        figures["actuators"] = lambda: _actuators(prediction)
    return figures


def _poles(prediction: Prediction) -> Figure:
    height, under_title = 4.4, 0.3  # in
    figure = style.blank(9.6, height)
    style.head(figure, "Controllable closed-loop poles over the operating range", {})
    panel = style.place(figure, 0.75, 0.75, 8.6, 3.1)
    for point, mark, colour in zip(prediction.points, _MARKS, _COLOURS, strict=False):
        marker_style: Any = {"color": colour, "markerfacecolor": "none", "markersize": 5.5}
        panel.plot(np.real(point.poles), np.imag(point.poles), mark, **marker_style, label=point.where)
    panel.set_xscale("symlog", linthresh=1.0, linscale=0.5)
    panel.set_yscale("symlog", linthresh=1.0, linscale=0.5)
    right = max(1.0, *(float(np.real(point.poles).max(initial=0.0)) for point in prediction.points))
    panel.set_xlim(right=1.3 * right)
    panel.axvspan(0, 1.3 * right, color="#fbe3df", zorder=0)
    style.note(panel, "unstable", (1.0, 1.0), (-3, -3), ha="right", va="top", fontsize=style.SMALL)
    # Beside the panel: poles may be anywhere inside.
    figure.legend(
        handles=panel.get_legend_handles_labels()[0],
        ncols=len(prediction.points),
        fontsize=style.SMALL,
        frameon=False,
        loc="upper left",
        bbox_to_anchor=(0.005, 1 - under_title / height),
    )
    style.label(panel, "real part, 1/s", "imaginary part, rad/s")
    return figure


def _frequency(prediction: Prediction) -> Figure:
    figure = style.blank(9.6, 3.7)
    names = prediction.operating_point.built.closed_loop.plant.outputs
    looks = {name: style.Look(_COLOURS[i % 6], _DASHES[i % 6], 1.2, 3) for i, name in enumerate(names)}
    style.head(figure, "Frequency response to a disturbance", looks)
    error_panel = _log(figure, 0.75)
    estimation_panel = _log(figure, 5.55)
    for i, look in enumerate(looks.values()):
        error_panel.plot(prediction.frequency, np.maximum(prediction.error[:, i], 1e-12), **look.line)
        estimation_panel.plot(prediction.frequency, np.maximum(prediction.estimation[:, i], 1e-12), **look.line)
    estimation_panel.axhline(1.0, color=style.INK, linewidth=0.8, linestyle=(0, (1, 1.8)))
    style.label(error_panel, "frequency of d, rad/s", "|e| / |d|, s$^2$", "tracking error")
    style.label(
        estimation_panel,
        "frequency of d, rad/s",
        r"$|\hat{d} - d| \,/\, |d|$",
        "estimation error; above 1 the estimate adds error",
    )
    return figure


def _actuators(prediction: Prediction) -> Figure:
    authority = prediction.authority
    plant = prediction.operating_point.built.closed_loop.plant
    looks = {"largest demand": style.SOLID, "forward limit": _FORWARD, "reverse limit": _REVERSE}
    figure = style.blank(9.6, 2.9)
    style.head(figure, "Largest force demanded from each actuator, and its limits", looks)
    panel = style.place(figure, 0.75, 0.55, 8.6, 1.85)
    number = np.arange(1, len(authority.demand) + 1)
    panel.bar(number, authority.demand, width=0.5, color=style.SOLID.colour)
    for side, look in ((authority.high, _FORWARD), (-authority.low, _REVERSE)):
        panel.hlines(side, number - 0.38, number + 0.38, color=look.colour, linestyle=look.dashes, linewidth=1.4)
    panel.set_xticks(number, [_stacked(name) for name in input_names(plant)])
    panel.set_ylim(0, 1.1 * max(authority.demand.max(), np.max(authority.high[np.isfinite(authority.high)])))
    style.label(panel, "", force_label(plant))
    return figure


def force_label(plant: AbstractPlant) -> str:
    """`force`, with its unit where it is that of thrusters."""
    return "force, N" if hasattr(plant, "vehicle") else "force"


def _stacked(name: str) -> str:
    """A name in lines: number, `vertical`, place."""
    return name.replace(" ", "\n", 2 if "vertical" in name else 1)


def _log(figure: Figure, left: float) -> Axes:
    panel = style.place(figure, left, 0.62, 3.8, 2.5)
    panel.set_xscale("log")
    panel.set_yscale("log")
    return panel
