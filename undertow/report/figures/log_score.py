"""Figure: error of a predicted motion against the time since the start of the prediction."""

import math

from matplotlib.figure import Figure
from numpy.typing import NDArray

from undertow.report.figures import style

_DEGREES = math.degrees(1.0)
# Title, axes, factor from SI units to those of the title, and the smallest height: less matters to no vehicle.
_PANELS = (
    ("position, m", ("north", "east", "down"), 1.0, 0.01),
    ("attitude, degrees", ("roll", "pitch", "yaw"), _DEGREES, 0.1),
    ("velocity, m/s", ("surge", "sway", "heave"), 1.0, 0.01),
    ("angular velocity, degrees/s", ("p", "q", "r"), _DEGREES, 0.1),
)
_LOOKS = (style.SOLID, style.DASHED, style.Look("#009e73", (0, (1, 1.2)), 1.3, 4))

_HEADROOM = 1.55  # over the largest error, for the key


def log_score_figure(times: NDArray, growth: NDArray) -> Figure:
    """Root mean square over all starts, of each axis.

    Args:
        times: since the start, s, shape (times,).
        growth: errors, shape (times, 12), m, rad, m/s and rad/s.
    """
    figure = style.blank(9.8, 2.6)
    style.head(figure, "Error of the predicted motion", {})
    for number, (title, axes, factor, least) in enumerate(_PANELS):
        panel = style.place(figure, 0.62 + 2.4 * number, 0.62, 1.75, 1.4)
        for i, (axis, look) in enumerate(zip(axes, _LOOKS, strict=True)):
            panel.plot(times, factor * growth[:, 3 * number + i], label=axis, **look.line)
        panel.set_xlim(0, times[-1])
        panel.set_ylim(0, _HEADROOM * max(panel.dataLim.y1, least))
        panel.legend(fontsize=style.TINY, frameon=False, loc="upper left", handlelength=2.4, borderaxespad=0.2)
        style.label(panel, "time since the start, s", "", title)
    return figure
