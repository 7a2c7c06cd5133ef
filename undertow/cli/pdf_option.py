"""Option `--pdf` of the commands that write figures."""

from undertow.core import checks
from undertow.report.figures.writing import PDF_WIDTHS


def check_pdf(width: str | None) -> None:
    """Check the width of PDF figures before anything is computed; None for no PDF files.

    Raises:
        BadInput: there is no such width.
    """
    if width is not None:
        checks.choice("--pdf", width, PDF_WIDTHS)
