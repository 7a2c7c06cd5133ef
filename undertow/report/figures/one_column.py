"""A figure in the width of one printed column: panels below each other, the key above them, no title."""

import textwrap

from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.text import Annotation, Text
from matplotlib.ticker import LogLocator, MaxNLocator
from matplotlib.transforms import ScaledTranslation, Transform

from undertow.report.figures import style

WIDTH = 3.5  # in
_TALLEST = 9.0  # in, of a page without margins
_LOWEST, _NARROWEST = 0.5, 1.0  # in, of a panel
_GAP, _EDGE = 0.06, 0.04  # in, between panels, and left of what stands beside them
_LINE = 0.15  # in, height of a title
_LONG = 1.2  # in, names beside a panel that are longer do not move the others
_FINE = 600  # dots per inch to measure with: at fewer, letters are moved to whole dots, and narrower than in the PDF
_LETTERS = 46  # of a title in the width of a column
_NAME = 34  # letters in a line of a name beside a panel
_LABEL = 60  # letters in a line of a label below a panel
_OVER = 0.1  # share of a panel by which the last tick label may stand out
_FEW = 8  # panels; more of them stand in two columns


def one_column(figure: Figure) -> Figure:
    """Rearrange a figure in place; a caption takes the place of its title.

    Panels keep their order, their height where the page is tall enough, and the size of their text. A panel with long
    names beside it, or a matrix, may need more than the width of a column.
    """
    resolution = figure.dpi
    figure.dpi = _FINE
    try:
        return _rearranged(figure, FigureCanvasAgg(figure))
    finally:
        figure.dpi = resolution


def _rearranged(figure: Figure, canvas: FigureCanvasAgg) -> Figure:
    for title in list(figure.texts):
        title.remove()
    panels = figure.axes
    across = 2 if len(figure.axes) > _FEW else 1
    _label_last(panels, across)
    for panel in panels:
        for title in panel.findobj(Text):
            if title.get_text() == panel.get_title(loc="left"):
                title.set_text("\n".join(textwrap.wrap(title.get_text(), _LETTERS)))
        _raise_notes(panel)
        _wrap(panel)
    margins = [_around(panel, canvas) for panel in panels]
    # Panels with long names beside them begin further to the right than the others, but end with them.
    left = max((margin[0] for margin in margins if margin[0] < _LONG), default=0.4)
    right = max(margin[1] for margin in margins)
    indents = [max(margin[0] - left, 0.0) for margin in margins]
    widths_of_images = [
        panel.get_position().width * figure.get_size_inches()[0] if panel.images else 0.0 for panel in panels
    ]
    panel_width = max(
        (WIDTH - (across - 1) * _GAP) / across - left - right,
        _NARROWEST + max(indents),
        *map(sum, zip(widths_of_images, indents, strict=True)),
    )
    rows = [range(first, min(first + across, len(panels))) for first in range(0, len(panels), across)]
    above, below = ([max(margins[i][side] for i in row) for row in rows] for side in (2, 3))
    heights = [max(panels[i].get_position().height for i in row) * figure.get_size_inches()[1] for row in rows]
    figure.set_size_inches(across * (left + panel_width + right) + (across - 1) * _GAP, _TALLEST)
    key = _key(figure, canvas)
    room = _TALLEST - key - sum(above) - sum(below) - _GAP * len(rows)
    heights = [max(min(1.0, room / sum(heights)) * height, min(height, _LOWEST)) for height in heights]
    figure.set_size_inches(figure.get_size_inches()[0], key + sum(above) + sum(below) + sum(heights) + _GAP * len(rows))
    top = key
    for row, margin_above, panel_height, margin_below in zip(rows, above, heights, below, strict=True):
        for column, i in enumerate(row):
            panel_left = column * (left + panel_width + right + _GAP) + left + indents[i]
            _move(panels[i], panel_left, top + margin_above, panel_width - indents[i], panel_height)
            if indents[i]:
                panels[i].xaxis.label.set_horizontalalignment("right")
                panels[i].xaxis.set_label_coords(1.0, 0.0, transform=_lifted(panels[i], -0.2))
        top += margin_above + panel_height + margin_below + _GAP
    _key(figure, canvas)
    return figure


def _label_last(panels: list[Axes], across: int) -> None:
    """Leave an x axis that several panels below each other share to the lowest of them to label."""
    axis = [(panel.get_xlabel(), panel.get_xlim()) for panel in panels]
    for panel, label_and_limits, label_and_limits_below in zip(panels, axis, axis[across:], strict=False):
        if label_and_limits == label_and_limits_below:
            panel.set_xlabel("")


def _wrap(panel: Axes) -> None:
    """Break long names beside a panel, and a long label below it."""
    panel.set_xlabel("\n".join(textwrap.wrap(panel.get_xlabel(), _LABEL)))
    names = panel.get_yticklabels()
    if max((len(line) for name in names for line in name.get_text().split("\n")), default=0) > _NAME:
        wrapped = ["\n".join(textwrap.wrap(name.get_text(), _NAME, break_long_words=False)) for name in names]
        panel.set_yticks(panel.get_yticks(), wrapped, fontsize=names[0].get_fontsize())


def _raise_notes(panel: Axes) -> None:
    """Lift what stands above a panel beside its title above the title, for which the panel is too narrow."""
    if not panel.get_title(loc="left"):
        return
    for note in panel.texts:
        if isinstance(note, Annotation) and note.xycoords == "axes fraction" and note.xy[1] == 1 and note.xyann[1] > 0:
            note.xyann = (note.xyann[0], note.xyann[1] + 72 * _LINE)
    key = panel.get_legend()
    if key is not None and key.get_window_extent().y0 >= panel.get_window_extent().y1 - 1:
        key.set_bbox_to_anchor((1.0, 1.0), transform=_lifted(panel, _LINE))


def _lifted(panel: Axes, up: float) -> Transform:
    """Fractions of a panel, moved up by inches."""
    return panel.transAxes + ScaledTranslation(0, up, panel.figure.dpi_scale_trans)


def _around(panel: Axes, canvas: FigureCanvasAgg) -> tuple[float, float, float, float]:
    """Space that labels take at the left, at the right, above and below, in."""
    renderer, inner = canvas.get_renderer(), panel.get_window_extent()
    outer = panel.get_tightbbox(renderer)
    beside = panel.yaxis.get_tightbbox(renderer)
    ticks = [label.get_window_extent(renderer).x1 for label in panel.get_xticklabels() if label.get_visible()]
    if outer is None:
        return 0.0, 0.0, 0.0, 0.0
    # Where a panel is moved to, a tick may stand at its upper edge.
    letters = max((label.get_window_extent(renderer).height for label in panel.get_yticklabels()), default=0.0)
    left = inner.x0 - beside.x0 if beside else 0.0
    right = min(max(ticks, default=0.0) - inner.x1, _OVER * inner.width)
    sides = left, right, max(outer.y1 - inner.y1, letters / 2), inner.y0 - outer.y0
    edge = (_EDGE, 0.0, 0.0, 0.0)
    return tuple(max(side, 0.0) / panel.figure.dpi + extra for side, extra in zip(sides, edge, strict=True))  # pyright: ignore[reportReturnType]


def _key(figure: Figure, canvas: FigureCanvasAgg) -> float:
    """Place the keys above the panels, in as many lines as they need; their height, in."""
    wide, tall = figure.get_size_inches()
    top = 0.0
    for old in list(figure.legends):
        handles = old.legend_handles
        words = [text.get_text() for text in old.get_texts()]
        old.remove()
        for columns in range(len(words), 0, -1):
            new = figure.legend(
                handles=handles, labels=words, ncols=columns, fontsize=style.SMALL, frameon=False, loc="upper left",
                bbox_to_anchor=(0.0, 1.0 - top / tall), handlelength=2.4, columnspacing=1.0, borderaxespad=0.2,
            )  # fmt: skip
            box = new.get_window_extent(canvas.get_renderer())
            if box.width <= wide * figure.dpi or columns == 1:
                top += box.height / figure.dpi
                break
            new.remove()
    return top


def _move(panel: Axes, left: float, top: float, width: float, height: float) -> None:
    page_width, page_height = panel.figure.get_size_inches()  # pyright: ignore[reportAttributeAccessIssue]
    share = (left / page_width, 1 - (top + height) / page_height, width / page_width, height / page_height)
    panel.set_position(share)
    if isinstance(panel.xaxis.get_major_locator(), MaxNLocator):
        panel.xaxis.set_major_locator(MaxNLocator(max(2, int(width / 0.4)), steps=style.STEPS))
    elif isinstance(panel.xaxis.get_major_locator(), LogLocator):
        panel.xaxis.set_major_locator(LogLocator(numticks=max(2, int(width / 0.4))))
