"""Directive that shows who sends what to whom: boxes and labelled arrows, from lines `SENDER -> RECEIVER: SIGNAL`.

The argument of `{signal-flow}` is the caption. A receiver stands one row below its sender, unless an earlier line has
placed it. Arrows between rows that are not neighbours, such as a feedback, go along the side.
"""

from collections.abc import Sequence
from typing import Any

from docutils import nodes
from flow_svg import Arrow, row_numbers, svg_of
from sphinx.application import Sphinx
from sphinx.util.docutils import SphinxDirective


class SignalFlow(SphinxDirective):
    """Boxes and arrows with a caption."""

    required_arguments = 1
    final_argument_whitespace = True
    has_content = True

    def run(self) -> list[nodes.Node]:
        caption = " ".join(self.arguments[0].split())
        page = self.env.doc2path(self.env.docname, base=False)
        first = self.lineno + self.content_offset + 1  # in Markdown the offset counts from the line of the directive
        try:
            arrows = arrows_of([*self.content], str(page), first)
        except ValueError as error:
            raise self.error(str(error)) from error
        figure = nodes.figure()
        figure += nodes.raw("", svg_of(arrows, caption), format="html")
        figure += nodes.caption("", caption)
        return [figure]


def arrows_of(lines: Sequence[str], page: str, first: int) -> list[Arrow]:
    """The arrows that lines of a page name, from the line with the number `first` on."""
    arrows: list[Arrow] = []
    for number, line in enumerate(lines, start=first):
        if not line.strip():
            continue
        names, _, signal = line.strip().partition(": ")
        ends = [name.strip() for name in names.split("->")]
        if len(ends) != 2 or not all([*ends, signal.strip()]):
            raise ValueError(f"{page}, line {number}: must be `SENDER -> RECEIVER: SIGNAL`, got `{line.strip()}`.")
        sender, receiver = ends
        arrows.append(Arrow(sender, receiver, signal.strip()))
        rows = row_numbers(arrows)
        if rows[sender] == rows[receiver]:
            raise ValueError(
                f"{page}, line {number}: `{sender}` and `{receiver}` must stand in different rows, got the same one. "
                "Move the line upwards."
            )
    return arrows


def setup(app: Sphinx) -> dict[str, Any]:
    """Register the directive."""
    app.add_directive("signal-flow", SignalFlow)
    return {"parallel_read_safe": True}
