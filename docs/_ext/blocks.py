"""Building blocks of generated pages: text with code in backquotes, tables, and sections that can be linked to."""

import re
from collections.abc import Iterable, Sequence

from docutils import nodes

_SHORT = 24  # characters that stay on one line

_CODE = re.compile(r"`([^`]+)`")
_PATH = re.compile(r"(?<=[\w.-]{4})/(?=\w{4})")


def paragraph(text: str) -> nodes.paragraph:
    """A paragraph; what stands between backquotes is code, and a path may be broken after a slash."""
    found = nodes.paragraph()
    for number, piece in enumerate(_CODE.split(text)):
        if piece:
            found += nodes.literal(piece, piece) if number % 2 else nodes.Text(_PATH.sub("/\u200b", piece))
    return found


def paragraphs(text: str) -> list[nodes.paragraph]:
    """The paragraphs of a docstring."""
    return [paragraph(" ".join(one.split())) for one in text.split("\n\n") if one.strip()]


def code(text: str) -> nodes.line_block:
    """A cell of code; each of its lines stands on its own."""
    found = nodes.line_block()
    for line in text.splitlines():
        found += nodes.line("", "", nodes.literal(line, line, classes=["short"] if len(line) < _SHORT else []))
    return found


def table(columns: Sequence[str], rows: Iterable[Sequence[str]], codes: Sequence[str] = ()) -> nodes.table:
    """A table of texts; the columns in `codes` are set as code. Columns that are empty in all rows are left out."""
    rows = [list(row) for row in rows]
    shown = [k for k in range(len(columns)) if not rows or any(row[k] for row in rows)]
    group = nodes.tgroup(cols=len(shown))
    group += [nodes.colspec(colwidth=1) for _ in shown]
    head, body = nodes.thead(), nodes.tbody()
    head += _row([paragraph(columns[k]) for k in shown])
    body += [_row([code(row[k]) if columns[k] in codes else paragraph(row[k]) for k in shown]) for row in rows]
    group += [head, body]
    return nodes.table("", group, classes=["colwidths-auto", "facts"])


def section(title: str, name: str, *contents: nodes.Node) -> nodes.section:
    """A section whose address on the page is `name`."""
    found = nodes.section(ids=[nodes.make_id(name)], names=[nodes.fully_normalize_name(title)])
    found += nodes.title("", "", *paragraph(title).children)
    found += list(contents)
    return found


def _row(cells: Sequence[nodes.Node]) -> nodes.row:
    row = nodes.row()
    row += [nodes.entry("", cell) for cell in cells]
    return row
