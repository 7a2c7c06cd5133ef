"""Small pictures as SVG elements, made in a few milliseconds without Matplotlib."""

from collections.abc import Sequence

from undertow.report.page import Html, tag, text

BLUE, GREY, RED = "#1f6f9f", "#9a9a9a", "#b3402a"


def picture(width: float, height: float, *parts: Html) -> Html:
    """An SVG element of that size in pixels, which shrinks with the page."""
    look = f"width:100%;max-width:{width / 16:g}em;background:#fff"
    return tag("svg", *parts, viewBox=f"0 0 {width:g} {height:g}", style=look)


def words(x: float, y: float, content: str, anchor: str = "start") -> Html:
    """A text that starts, ends or has its middle at a point."""
    looks = f'font-family="sans-serif" font-size="12" text-anchor="{anchor}" fill="#333"'
    return Html(f'<text x="{x:.0f}" y="{y:.0f}" {looks}>{text(content)}</text>')


def polyline(points: Sequence[tuple[float, float]], colour: str, dashed: bool = False) -> Html:
    """A line through points."""
    dashes = ' stroke-dasharray="6 3"' if dashed else ""
    corners = " ".join(f"{x:.1f},{y:.1f}" for x, y in points)
    return Html(f'<polyline points="{corners}" fill="none" stroke="{colour}" stroke-width="1.6"{dashes}/>')
