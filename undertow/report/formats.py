"""Numbers, units, text and verdicts as HTML."""

import math
import re
from collections.abc import Mapping
from typing import Any

from undertow.report.mathml import with_symbols
from undertow.report.page import Html, join, marked, tag, text

_DIGITS = 3


def number(value: Any, digits: int = _DIGITS) -> Html:
    """A number with the given digits; powers of ten are written out, and a dash stands for a missing number."""
    if value is None:
        return Html("&ndash;")
    if isinstance(value, float) and not math.isfinite(value):
        return text(value)
    if value and not 1e-3 <= abs(value) < 1e5:
        mantissa, exponent = f"{value:.{digits - 1}e}".split("e")
        return join(_minus(mantissa), Html("&thinsp;&times;&thinsp;10"), tag("sup", _minus(str(int(exponent)))))
    return text(_minus(f"{value:.{digits}g}" if abs(value) < 1000 else f"{value:.0f}"))


def percent(value: float | None) -> Html:
    """A signed difference in %."""
    if value is None:
        return number(None)
    return join(_minus(f"{value:+.1f}" if round(value, 1) else "0.0"), Html("&nbsp;%"))


def prose(content: Any) -> Html:
    """Plain text with formulas and symbols typeset, powers of units raised (m/s^2) and `code` set as code."""
    return (
        content
        if isinstance(content, Html)
        else marked(r"`([^`]+)`", content, lambda code: tag("code", code), _typeset)
    )


def _typeset(plain: str) -> Html:
    marked = re.sub(r"\^(-?\d)", r"<sup>\1</sup>", with_symbols(plain))
    return Html(re.sub(r"\b([A-Za-z])_([A-Za-z0-9])\b", r"\1<sub>\2</sub>", marked))


def unit(value: str) -> Html:
    """A unit in small print."""
    return tag("span", prose(value), class_="unit") if value else Html("")


def kind(verdict: str) -> str:
    """Class of a verdict: holds, partly, fails or open."""
    if verdict in ("holds", "fails"):
        return verdict
    return "partly" if verdict.startswith("holds") else "open"


def chip(verdict: str) -> Html:
    """A verdict in one or two words, coloured."""
    word = kind(verdict)
    return tag("span", "holds if" if word == "partly" else word, class_=f"chip {word}")


def condition(verdict: str) -> str:
    """The condition of a verdict: the text after `holds if`."""
    return verdict.removeprefix("holds if").strip() if kind(verdict) == "partly" else ""


def ending(entry: Mapping[str, Any]) -> str:
    """Status of a run, with the time if it ended early."""
    word, when = str(entry.get("status", "completed")).replace("_", " "), entry.get("diverged_at")
    return word if when is None else f"{word} at {when:.3g} s"


def round_time(seconds: float) -> str:
    """Three digits, but whole seconds from 100 s on."""
    return f"{seconds:.0f}" if seconds >= 100 else f"{seconds:.3g}"


def _minus(value: str) -> str:
    """With a typographic minus sign."""
    return value.replace("-", "\u2212")
