"""Boxes and labelled arrows as SVG: rows of boxes from the top down, as wide as a phone."""

import html
import textwrap
from collections.abc import Sequence
from typing import NamedTuple

# Pixels of a picture that fills a phone, with letters of 13 pixels.
WIDTH, SIDE, WIDEST_BOX, SPACE = 420.0, 104.0, 340.0, 14.0
LINE_HEIGHT, LETTER, MARGIN = 17.0, 6.8, 15.0


class Arrow(NamedTuple):
    """A signal, and the names of the boxes at its ends."""

    sender: str
    receiver: str
    signal: str


class Box(NamedTuple):
    """A rectangle around its middle (x, y), with lines of text."""

    x: float
    y: float
    width: float
    height: float
    lines: tuple[str, ...]


class Span(NamedTuple):
    """Where an arrow between two rows meets the upper row and the lower one."""

    top: float
    bottom: float

    def at(self, share: float) -> float:
        """The place of the arrow at a share of the way down."""
        return self.top + share * (self.bottom - self.top)


def row_numbers(arrows: Sequence[Arrow]) -> dict[str, int]:
    """The row of each box; the top row is 0."""
    rows: dict[str, int] = {}
    for arrow in arrows:
        if arrow.sender not in rows:
            rows[arrow.sender] = rows.get(arrow.receiver, 1) - 1
        rows.setdefault(arrow.receiver, rows[arrow.sender] + 1)
    top = min(rows.values(), default=0)
    return {name: row - top for name, row in rows.items()}


def svg_of(arrows: Sequence[Arrow], caption: str) -> str:
    """The boxes and arrows as SVG, with a text for readers who do not see it."""
    rows = row_numbers(arrows)
    sides = _sides(arrows, rows)
    left = SIDE if "left" in sides.values() else 0.0
    right = WIDTH - SIDE if "right" in sides.values() else WIDTH
    boxes: dict[str, Box] = {}
    lines: list[str] = []
    labels: list[Box] = []
    bottom = 1.0
    for row in range(max(rows.values(), default=-1) + 1):
        names = [name for name in rows if rows[name] == row]
        boxes |= _row_of_boxes(names, left, right)
        between = [arrow for arrow in arrows if {rows[arrow.sender], rows[arrow.receiver]} == {row - 1, row}]
        spans = [_span(arrow, between, boxes, rows) for arrow in between]
        room = min(max((right - left) / max(len(between), 1) - 8, 100.0), 220.0)
        signals = [_wrapped(arrow.signal, room) for arrow in between]
        gap, placed = _place_labels(signals, spans, (left, right)) if between else (0.0, [])
        for arrow, span in zip(between, spans, strict=True):
            way = [(span.top, bottom), (span.bottom, bottom + gap)]
            lines.append(_line(way if rows[arrow.receiver] == row else way[::-1]))
        labels += [label._replace(y=bottom + label.y) for label in placed]
        height = boxes[names[0]].height
        boxes |= {name: boxes[name]._replace(y=bottom + gap + height / 2) for name in names}
        bottom += gap + height
    for arrow, side in sides.items():
        edge = left if side == "left" else right
        line, label = _beside(boxes[arrow.sender], boxes[arrow.receiver], arrow.signal, edge)
        lines.append(line)
        labels.append(label)
    texts = [_text(box, "box") for box in boxes.values()] + [_text(label, "label") for label in labels]
    sentences = [f"{arrow.sender} to {arrow.receiver}: {arrow.signal}." for arrow in arrows]
    description = html.escape(" ".join([caption, *sentences]))
    size = f'viewBox="0 0 {WIDTH:g} {bottom + 1:g}"'
    return f'<svg class="signal-flow" {size} role="img" aria-label="{description}">{"".join([*lines, *texts])}</svg>'


def _sides(arrows: Sequence[Arrow], rows: dict[str, int]) -> dict[Arrow, str]:
    """The side of each arrow between rows that are not neighbours: one where no other box is in its way."""
    passing = [arrow for arrow in arrows if abs(rows[arrow.sender] - rows[arrow.receiver]) > 1]
    free: dict[Arrow, list[str]] = {}
    for arrow in passing:
        beside = [[name for name in rows if rows[name] == rows[end]] for end in arrow[:2]]
        outermost = {"right": [names[-1] for names in beside], "left": [names[0] for names in beside]}
        free[arrow] = [side for side, names in outermost.items() if names == [*arrow[:2]]] or [*outermost]
    sides: dict[Arrow, str] = {}
    for arrow in sorted(passing, key=lambda arrow: len(free[arrow])):
        sides[arrow] = min(free[arrow], key=[*sides.values()].count)
    return sides


def _beside(sender: Box, receiver: Box, signal: str, edge: float) -> tuple[str, Box]:
    """An arrow along the side of the boxes, whose edge is given, and its label."""
    outwards = -1 if edge < sender.x else 1
    x = edge + outwards * 12
    start = (sender.x + outwards * sender.width / 2, sender.y + 6)
    end = (receiver.x + outwards * receiver.width / 2, receiver.y - 6)
    label = _label(x + outwards * (SIDE - 12) / 2, (sender.y + receiver.y) / 2, _wrapped(signal, SIDE - 22))
    return _line([start, (x, start[1]), (x, end[1]), end]), label


def _row_of_boxes(names: Sequence[str], left: float, right: float) -> dict[str, Box]:
    """Boxes beside each other, all as high as the highest; how far from the top is decided later."""
    room = (right - left) / len(names)
    width = min(room - SPACE, WIDEST_BOX)
    texts = [_wrapped(name, width - 12) for name in names]
    height = max(map(len, texts)) * LINE_HEIGHT + 14
    return {
        name: Box(left + (number + 0.5) * room, 0.0, width, height, text)
        for number, (name, text) in enumerate(zip(names, texts, strict=True))
    }


def _span(arrow: Arrow, between: Sequence[Arrow], boxes: dict[str, Box], rows: dict[str, int]) -> Span:
    """The ends of an arrow; arrows between the same two boxes are parallel."""
    parallel = [other for other in between if {*other[:2]} == {*arrow[:2]}]
    upper, lower = sorted(arrow[:2], key=rows.__getitem__)
    apart = min(boxes[upper].width, boxes[lower].width) / len(parallel)
    offset = apart * (parallel.index(arrow) - (len(parallel) - 1) / 2)
    return Span(boxes[upper].x + offset, boxes[lower].x + offset)


def _place_labels(
    texts: Sequence[tuple[str, ...]], spans: Sequence[Span], limits: tuple[float, float]
) -> tuple[float, list[Box]]:
    """Height of the gap between two rows, and the labels in it.

    Each label is on its arrow. Labels stand beside each other on as few levels as possible, where they hide neither
    each other nor, if that can be had, another arrow.
    """
    height = max(map(len, texts)) * LINE_HEIGHT + 6
    for arrows_stay_free in (True, False):
        for levels in range(1, len(texts) + 1):
            gap = levels * height + 2 * MARGIN
            placed: list[Box] = []
            for text, span in zip(texts, spans, strict=True):
                others = [other for other in spans if other is not span and arrows_stay_free]
                for level in range(levels):
                    y = MARGIN + (level + 0.5) * height
                    half = _label(0.0, y, text).width / 2
                    x = min(max(span.at(y / gap), limits[0] + half), limits[1] - half)
                    hidden = [box.x for box in placed if box.y == y and abs(box.x - x) < half + box.width / 2]
                    hidden += [other.at(y / gap) for other in others if abs(other.at(y / gap) - x) < half]
                    if not hidden:
                        placed.append(_label(x, y, text))
                        break
            if len(placed) == len(texts):
                return gap, placed
    raise AssertionError("as many levels as labels are enough")


def _label(x: float, y: float, text: tuple[str, ...]) -> Box:
    """The lines of a label, and the space that they take."""
    return Box(x, y, max(map(len, text)) * LETTER + 6, len(text) * LINE_HEIGHT, text)


def _wrapped(text: str, width: float) -> tuple[str, ...]:
    """The text in lines of a width in pixels."""
    return tuple(textwrap.wrap(text, max(int(width / LETTER), 8), break_long_words=False))


def _line(points: Sequence[tuple[float, float]]) -> str:
    """A line through points, with the head of an arrow at its last one."""
    (x0, y0), (x, y) = points[-2:]
    length = ((x - x0) ** 2 + (y - y0) ** 2) ** 0.5
    u, v = (x - x0) / length, (y - y0) / length
    head = [(x, y), (x - 9 * u - 4 * v, y - 9 * v + 4 * u), (x - 9 * u + 4 * v, y - 9 * v - 4 * u)]
    way = [*points[:-1], (x - 8 * u, y - 8 * v)]
    corners, triangle = (" ".join(f"{a:.1f},{b:.1f}" for a, b in several) for several in (way, head))
    return f'<polyline points="{corners}"/><polygon points="{triangle}"/>'


def _text(box: Box, kind: str) -> str:
    """A box, or a label, with its lines of text."""
    left, top = box.x - box.width / 2, box.y - box.height / 2
    size = f'x="{left:.1f}" y="{top:.1f}" width="{box.width:.1f}" height="{box.height:.1f}"'
    first = box.y - (len(box.lines) - 1) * LINE_HEIGHT / 2 + 4.5
    spans = [
        f'<tspan x="{box.x:.1f}" y="{first + number * LINE_HEIGHT:.1f}">{html.escape(line)}</tspan>'
        for number, line in enumerate(box.lines)
    ]
    return f'<g class="{kind}"><rect {size}/><text>{"".join(spans)}</text></g>'
