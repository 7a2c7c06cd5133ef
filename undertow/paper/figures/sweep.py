"""Figure: relative error of the estimate of a sinusoidal uncertainty, against its frequency."""

from collections.abc import Mapping, Sequence
from typing import Any

from matplotlib.figure import Figure

from undertow.report.figures import style


def sweep_figure(sweep: Mapping[str, Mapping[str, Sequence[float]] | Any]) -> Figure:
    """Measured points against the theory's curve, one pair per controller.

    Args:
        sweep: by controller (`rcafc`, `rafc`), the lists `frequency` (rad/s) and `measured` (|d_err| / |d|), and
            `theory_frequency` (rad/s) and `theory` where there is a prediction.
    """
    figure = style.blank(9.6, 3.7)
    looks = {key: look for key, look in style.CONTROLLERS.items() if key in sweep}
    style.head(figure, "Estimation error against frequency", {})
    panel = style.place(figure, 0.62, 0.55, 8.75, 2.7)
    panel.set_xscale("log")
    panel.set_yscale("log")
    for key, (name, look) in looks.items():
        points = sweep[key]
        if points.get("theory"):
            wider = look._replace(width=look.width + 0.2)
            panel.plot(points["theory_frequency"], points["theory"], **wider.line, label=f"{name}, theory")
        panel.plot(
            points["frequency"],
            points["measured"],
            style.MARKS[key],
            color=look.colour,
            markerfacecolor="white",
            markersize=5,
            zorder=5,
            label=f"{name}, measured",
        )
    panel.axhline(1.0, color=style.INK, linewidth=0.8, linestyle=(0, (1, 1.8)))
    words = "above this line the estimate increases the error"
    style.note(panel, words, (0.01, 1.0), (0, 2), xycoords=("axes fraction", "data"), va="bottom")
    panel.legend(fontsize=style.SMALL, frameon=False, loc="lower right", handlelength=3.2)
    style.label(panel, "frequency of d, rad/s", r"$|\hat{d} - d| \,/\, |d|$ (ratio)")
    return figure
