"""Figure: error of a predicted motion against the time since the start of the prediction."""

from matplotlib.figure import Figure
from numpy.typing import NDArray

from undertow.report.figures import style

_PANELS = (
    ("position, m", ("north", "east", "down")),
    ("attitude, rad", ("roll", "pitch", "yaw")),
    ("velocity, m/s", ("surge", "sway", "heave")),
    ("angular velocity, rad/s", ("p", "q", "r")),
)
_LOOKS = (style.SOLID, style.DASHED, style.Look("#009e73", (0, (1, 1.2)), 1.3, 4))

_HEADROOM = 1.55  # over the largest error, for the key


def log_score_figure(times: NDArray, growth: NDArray) -> Figure:
    """Root mean square over all starts, of each axis.

    Args:
        times: since the start, s, shape (times,).
        growth: errors, shape (times, 12).
    """
    figure = style.blank(9.8, 2.6)
    style.head(figure, "Error of the predicted motion", {})
    for number, (title, axes) in enumerate(_PANELS):
        panel = style.place(figure, 0.62 + 2.4 * number, 0.62, 1.75, 1.4)
        for i, (axis, look) in enumerate(zip(axes, _LOOKS, strict=True)):
            panel.plot(times, growth[:, 3 * number + i], label=axis, **look.line)
        panel.set_xlim(0, times[-1])
        panel.set_ylim(0, _HEADROOM * max(panel.dataLim.y1, 1e-12))
        panel.legend(fontsize=style.TINY, frameon=False, loc="upper left", handlelength=2.4, borderaxespad=0.2)
        style.label(panel, "time since the start, s", "", title)
    return figure
