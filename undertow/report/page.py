"""One self-contained HTML page: nothing loaded from anywhere, readable on a phone and on paper."""

import base64
import html
import re
from collections.abc import Callable, Sequence
from importlib.resources import files
from typing import Any

# Letters in the width of a phone, and those that the space between two columns takes.
_PHONE, _BETWEEN = 46, 2.5


class Html(str):
    """Markup, put into a page as it is. Every other text is escaped."""

    __slots__ = ()


def text(content: Any) -> Html:
    """Content as markup: escaped unless it is markup already."""
    return content if isinstance(content, Html) else Html(html.escape(str(content)))


def join(*parts: Any) -> Html:
    """Parts one after the other."""
    return Html("".join(map(text, parts)))


def marked(pattern: str, content: str, inside: Callable[[str], Html], outside: Callable[[str], Html] = text) -> Html:
    """Plain text with what the group of a pattern captures as markup of one kind, and the rest as another."""
    parts = enumerate(re.split(pattern, content))
    return join(*(inside(part) if number % 2 else outside(part) for number, part in parts))


def tag(name: str, *content: Any, **attributes: str) -> Html:
    """An element; `class_` stands for the attribute `class`."""
    attribute_text = "".join(f' {key.rstrip("_")}="{html.escape(value)}"' for key, value in attributes.items())
    return Html(f"<{name}{attribute_text}>{join(*content)}</{name}>")


def bullets(items: Sequence[Any]) -> Html:
    """A list."""
    return tag("ul", *(tag("li", item) for item in items))


def table(head: Sequence[Any], rows: Sequence[Sequence[Any]], numeric: Sequence[int] = (), wide: bool = False) -> Html:
    """A table that scrolls inside its own box where the screen is narrow.

    Args:
        head: column titles.
        rows: cells, the first of a row names it.
        numeric: columns set to the right.
        wide: too wide for a phone; keeps its width and scrolls.

    On a phone the first column of the other tables stays in view, and those whose numbers need more than its width have
    a hint that they scroll, too.
    """
    style = lambda column: {"class_": "number"} if column in numeric else {}
    titles = tag("tr", *(tag("th", cell, scope="col", **style(i)) for i, cell in enumerate(head)))
    head_rows = (tag("thead", titles),) if any(head) else ()
    body = []
    for row in rows:
        first = tag("th", row[0], scope="row", **style(0))
        body.append(tag("tr", first, *(tag("td", cell, **style(i)) for i, cell in enumerate(row[1:], 1))))
    table_element = tag("table", *head_rows, tag("tbody", *body), class_="wide" if wide else "fit")
    scrolls = wide or _letters(head, rows, numeric) > _PHONE
    return tag("div", table_element, class_="scroll wide" if scrolls else "scroll", tabindex="0")


def _letters(head: Sequence[Any], rows: Sequence[Sequence[Any]], numeric: Sequence[int]) -> float:
    """Letters in the width below which a table scrolls: columns of numbers do not break, others do between words."""
    plain = lambda cell: html.unescape(re.sub(r"<(?!wbr)[^>]*>", "", text(cell)).replace("<wbr>", " "))
    widest: dict[int, int] = {}
    for row in (head, *rows):
        for column, cell in enumerate(row):
            is_unbroken = column in numeric and row is not head
            parts = [plain(cell)] if is_unbroken else plain(cell).split()
            widest[column] = max([widest.get(column, 0), *map(len, parts)])
    return sum(widest.values()) + _BETWEEN * len(widest)


def figure(picture: str | bytes, name: str, alternative: str, caption: Any) -> Html:
    """A figure with its caption, embedded in the page; it scrolls inside its own box where the screen is narrow.

    Args:
        picture: SVG (text) or PNG (bytes).
        name: of the figure, for links.
        alternative: what it shows, for those who cannot see it.
        caption: below it.
    """
    kind, content = ("svg+xml", picture.encode()) if isinstance(picture, str) else ("png", picture)
    data = base64.b64encode(content).decode()
    image = Html(f'<img src="data:image/{kind};base64,{data}" alt="{html.escape(alternative)}">')
    box = tag("div", image, class_="scroll wide", tabindex="0")
    return tag("figure", box, tag("figcaption", caption), id=f"figure-{name}")


def section(identity: str, title: str, *content: Any) -> Html:
    """A section of the page with a heading that links can point to."""
    return tag("section", tag("h2", title), *content, id=identity)


def folded(identity: str, title: str, *content: Any) -> Html:
    """A section that opens on demand."""
    return tag("details", tag("summary", tag("h2", title)), *content, id=identity, class_="folded")


def document(title: str, *content: Any, looks: str = "") -> str:
    """The whole page as text; `looks` are style sheets of its own."""
    looks = files("undertow.report").joinpath("page.css").read_text(encoding="utf-8") + looks
    head = (
        f'<meta charset="utf-8"><meta name="viewport" content="width=device-width, initial-scale=1">'
        f"<title>{html.escape(title)}</title><style>{looks}</style>"
    )
    return f'<!DOCTYPE html>\n<html lang="en"><head>{head}</head>\n<body><main>{join(*content)}</main></body></html>\n'
