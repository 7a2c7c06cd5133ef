"""Figures of one run: their files, which its page shows as well."""

from matplotlib.figure import Figure

from undertow.report.figures.run import run_plots
from undertow.report.figures.writing import make_all, pdf, small_png
from undertow.report.plotted import Plotted, Shown


def plot_run(shown: Shown, width: str | None = None) -> Plotted:
    """Figures of a run, each plotted once. A failed figure affects neither the others nor the results.

    Args:
        shown: what they show.
        width: of PDF files; None for none.
    """
    files: dict[str, bytes] = {}
    pictures: dict[str, bytes] = {}

    def put(name: str, figure: Figure) -> None:
        picture = small_png(figure)
        document = {} if width is None else {f"{name}.pdf": pdf(figure, width)}
        pictures[name] = picture
        files.update({f"{name}.png": picture} | document)

    failures = make_all(lambda: run_plots(shown), put)
    return Plotted(files, pictures, failures)
