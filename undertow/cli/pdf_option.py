"""Option `--pdf` of the commands that write figures."""

from undertow.core import checks

PDF_WIDTHS = ("wide", "one-column")  # as on the page, or rearranged for one column of a printed page


def check_pdf(width: str | None) -> None:
    """Check the width of PDF figures before anything is computed; None for no PDF files.

    Raises:
        BadInput: there is no such width.
    """
    if width is not None:
        checks.choice("--pdf", width, PDF_WIDTHS)
