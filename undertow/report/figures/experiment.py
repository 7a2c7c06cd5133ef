"""Figures of a designed experiment: where the vehicle goes in the rehearsal, and the deviations that are left."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from undertow.report.answers.identification_answer import in_words
from undertow.report.figures import style

_WIDTH = 6.4  # in
_ROW = 0.17  # in, of a parameter
_WAYS = ("along its heading, m", "across, m", "vertical, m")
_NOT_OF_INTEREST = style.MEASURED.colour


def rehearsal_figure(time: np.ndarray, away: np.ndarray, room: Sequence[float]) -> Figure:
    """The way of the vehicle from its station, between the limits of the room.

    Args:
        time: of the records, s.
        away: along its heading, across, vertical, m, (records, 3).
        room: length of the room each way, m, with the station in its middle.
    """
    height, gap, top = 0.85, 0.25, 0.45  # in
    figure = style.blank(_WIDTH, top + 3 * (height + gap) + 0.35)
    style.head(figure, "The vehicle in the rehearsal", {"away from the station": style.SOLID, "limit": style.DASHED})
    for i, (way, length) in enumerate(zip(_WAYS, room, strict=True)):
        panel = style.place(figure, 0.75, top + i * (height + gap), 5.4, height)
        panel.plot(time, away[:, i], **style.SOLID.line)
        for side in (-0.5, 0.5):
            panel.axhline(side * length, **style.DASHED.line)
        panel.set_xlim(float(time[0]), float(time[-1]))
        panel.set_ylim(-0.6 * length, 0.6 * length)
        is_last = i == len(_WAYS) - 1
        style.label(panel, "time, s" if is_last else "", way)
        if not is_last:
            panel.set_xticklabels([])
    return figure


def deviations_figure(parameters: Mapping[str, Mapping[str, Any]]) -> Figure:
    """The deviation that is left of each parameter, as a share of that before the experiment.

    Args:
        parameters: as in experiment.json.
    """
    names = sorted(parameters, key=lambda name: parameters[name]["deviation_left"])
    height = _ROW * len(names)
    figure = style.blank(_WIDTH, 0.4 + height + 0.45)
    style.head(figure, "Deviations after the experiment", {})
    panel = style.place(figure, 2.0, 0.4, 4.2, height)
    for i, name in enumerate(names):
        share = 100 * parameters[name]["deviation_left"]
        colour = style.SOLID.colour if parameters[name]["of_interest"] else _NOT_OF_INTEREST
        panel.plot([share, 100], [-i, -i], color=style.FAINT, linewidth=1.5, solid_capstyle="butt")
        panel.plot(share, -i, "o", color=colour, markersize=3.5)
    panel.axvline(50, color=style.INK, linewidth=0.6, zorder=0)
    panel.set_xlim(0, 102)
    panel.set_yticks([-i for i in range(len(names))], [in_words(name) for name in names])
    panel.set_ylim(0.5 - len(names), 0.5)
    style.label(panel, "left of the deviation before, %")
    return figure
