"""PDF files: as on the page, or in the width of one column, with every panel and none over another."""

import numpy as np
import pytest
from matplotlib.backends.backend_agg import FigureCanvasAgg

from undertow.paper.figures.fidelity import robust_fidelity_figure
from undertow.report.figures import run_figures, save, style
from undertow.report.figures.one_column import WIDTH, one_column
from undertow.report.figures.writing import pdf
from undertow.report.plotted import Shown

pytestmark = pytest.mark.full


def boxes(figure):
    """Left, bottom, right, top of every panel, in."""
    size = np.tile(figure.get_size_inches(), 2)
    return [np.array(panel.get_position().extents) * size for panel in figure.axes]


@pytest.mark.parametrize(("axes", "inputs", "name"), [(6, 2, "tracking"), (1, 8, "effort"), (1, 12, "effort")])
def test_panels_stand_below_each_other_in_one_column(make_run, axes, inputs, name):
    figure = run_figures(Shown(make_run(axes=axes, inputs=inputs)))[name]
    titles = [panel.get_title(loc="left") for panel in figure.axes]
    data = [line.get_ydata() for panel in figure.axes for line in panel.lines]
    figure = one_column(figure)
    wide, tall = figure.get_size_inches()
    assert wide == pytest.approx(WIDTH) and tall <= 9.5
    assert [panel.get_title(loc="left") for panel in figure.axes] == titles
    assert all(map(np.array_equal, data, (line.get_ydata() for panel in figure.axes for line in panel.lines)))
    for i, (left, bottom, right, top) in enumerate(found := boxes(figure)):
        assert 0 < left < right <= wide and 0 < bottom < top < tall
        assert all(top <= other[1] or left >= other[2] for other in found[:i]), "over another panel"
    assert not figure.texts and len(figure.legends) == 1


def test_long_names_and_labels_are_not_cut():
    """Of the robust variant beside the others: names of settings, a key of six laws and a long label."""
    words = "BlueROV2 Heavy, T200s at 16 V, 100 Hz, current, waves, own sensors"
    laws = ("table1", "rafc", "hand_tuned", "pid", "robust", "measured")
    ended = {"status": "completed", "diverged_at": None}
    rows = [
        {
            "place": place,
            "words": f"{place}: {words}",
            "law": law,
            **ended,
            "steady": {"tracking_rms": 10.0 ** -len(law)},
        }
        for place in ("sea", "overload")
        for law in laws
    ]
    figure = one_column(robust_fidelity_figure(rows, {}))
    assert figure.get_size_inches()[0] == WIDTH
    figure.dpi = 600
    drawn = figure.get_tightbbox(FigureCanvasAgg(figure).get_renderer())
    assert 0 <= drawn.x0 < drawn.x1 <= WIDTH


def test_only_an_axis_that_is_shared_is_labelled_once():
    """Panels of two quantities in turn, and of one quantity over two ranges, keep their labels; the upper ticks fit."""
    figure = style.blank(6.0, 3.0)
    for name, most in (("force, N", 3.0), ("speed, m/s", 3.0), ("force, N", 3.0), ("force, N", 3.0), ("force, N", 9.0)):
        panel = style.place(figure, 0.6, 0.5, 4.0, 2.0)
        panel.set_xlim(0.0, most)
        panel.set_ylim(0.0, 1.0)
        style.label(panel, name, "error, m")
    figure = one_column(figure)
    labels = [panel.get_xlabel() for panel in figure.axes]
    assert labels == ["force, N", "speed, m/s", "", "force, N", "force, N"]
    renderer, paper = FigureCanvasAgg(figure).get_renderer(), figure.get_size_inches()[1] * figure.dpi
    assert figure.axes[0].yaxis.get_tightbbox(renderer).y1 <= paper + 0.5  # dots


def test_files_and_their_bytes(make_run, tmp_path):
    figures = [run_figures(Shown(make_run(axes=1, inputs=1)))["tracking"] for _ in range(3)]
    save(figures[0], tmp_path, "none")
    save(figures[1], tmp_path, "wide", "wide")
    save(figures[2], tmp_path, "column", "one-column")
    assert sorted(path.name for path in tmp_path.glob("*.pdf")) == ["column.pdf", "wide.pdf"]
    assert (tmp_path / "wide.svg").read_bytes() == (tmp_path / "column.svg").read_bytes()
    wide, column = (tmp_path / f"{name}.pdf" for name in ("wide", "column"))
    assert wide.read_bytes() == pdf(figures[0], "wide") != column.read_bytes()
    assert b"CreationDate" not in wide.read_bytes() and b"/Subtype /Type3" not in wide.read_bytes()
    assert b"/MediaBox [ 0 0 252 " in column.read_bytes() or b"/MediaBox [ 0 0 252.0 " in column.read_bytes()
