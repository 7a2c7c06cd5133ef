"""Numbers, units, text and verdicts of every page: the one place that decides how they look.

A number has three significant digits, a typographic minus sign, and a power of ten below 0.001 and from 100 000 on.
"""

import math
import re
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from undertow.analysis.success import DEFAULT, evaluate_success
from undertow.core.number_text import DIGITS, LARGE, SMALL, display_units, plain, with_minus
from undertow.report.mathml import with_symbols
from undertow.report.page import Html, figure, join, marked, tag, text

# In plain text, as Python prints them: powers of ten, minus signs (not hyphens), and plus or minus.
_POWER = re.compile(r"(?<![\w.])(\d+(?:\.\d+)?)e([+-]?)0*(\d+)(?!\w)")
_NEGATIVE = re.compile(r"(?<![\w.)\]}>])-(?=[\d\u221e])")
_EITHER = re.compile(r"\+-(?=\s?\d)")
_TINY = re.compile(r"(?<![\w.])0\.000(0*)(\d+)(?!\w)")
_SIGNS = {"&lt;=": "&le;", "&gt;=": "&ge;"}


def number(value: Any, digits: int = DIGITS) -> Html:
    """A number with the given digits; powers of ten are written out, and a dash stands for a missing number."""
    if value is None:
        return Html("&ndash;")
    if isinstance(value, float) and not math.isfinite(value):
        return text(value)
    if value and not SMALL <= abs(value) < LARGE:
        mantissa, exponent = f"{value:.{digits - 1}e}".split("e")
        return _with_power(with_minus(mantissa), str(int(exponent)))
    return text(plain(value, digits))


def quantity(value: float | None, of: str, digits: int = DIGITS) -> Html:
    """A number with its unit; angles in degrees."""
    if value is None:
        return number(None)
    displayed, name = display_units(value, of)
    return join(number(displayed, digits), Html("&nbsp;"), unit(name)) if name else number(displayed, digits)


def percent(value: float | None) -> Html:
    """A signed difference in %."""
    if value is None:
        return number(None)
    return join(with_minus(f"{value:+.1f}" if round(value, 1) else "0.0"), Html("&nbsp;%"))


def prose(content: Any) -> Html:
    """Plain text with formulas and symbols typeset, powers of ten and of units raised, and `code` set as code."""
    return (
        content
        if isinstance(content, Html)
        else marked(r"`([^`]+)`", content, lambda code: tag("code", code), _typeset)
    )


def _typeset(words: str) -> Html:
    markup = _TINY.sub(lambda match: _scientific(len(match[1]), match[2]), with_symbols(words))
    markup = _POWER.sub(lambda match: _with_power(match[1], f"{match[2]}{match[3]}".lstrip("+")), markup)
    markup = re.sub(r"\^(-?\d)", lambda match: f"<sup>{with_minus(match[1])}</sup>", markup)
    markup = _NEGATIVE.sub("\u2212", _EITHER.sub("&plusmn;", markup))
    for sign, entity in _SIGNS.items():
        markup = markup.replace(sign, entity)
    return Html(re.sub(r"\b([A-Za-z])_([A-Za-z0-9])\b", r"\1<sub>\2</sub>", markup))


def _scientific(zeros: int, digits: str) -> Html:
    """0.000ddd with some more zeros, as d.dd times a power of ten."""
    return _with_power(digits[0] + (f".{digits[1:]}" if digits[1:] else ""), str(-4 - zeros))


def _with_power(mantissa: str, exponent: str) -> Html:
    return join(mantissa, Html("&thinsp;&times;&thinsp;10"), tag("sup", with_minus(exponent)))


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


_CLASSES = {True: "holds", False: "partly", None: "open"}

_WITHIN = " and ".join(
    f"{'{:.3g} {}'.format(*display_units(most, of))} in {name}"
    for most, of, name in ((DEFAULT["position_rms"], "m", "position"), (DEFAULT["attitude_rms"], "rad", "attitude"))
)

# What the colours of `outcome` mean, where runs are judged by the default criterion.
CRITERION = (
    f"Green: the run completed with an rms error below {_WITHIN} over the stated window. Amber: it completed with a "
    "larger error. Red: it ended early."
)


def meets_default_criterion(steady: Mapping[str, Any] | None) -> bool | None:
    """Whether the metrics of a steady window keep to the default criterion; None without any, as in a failed run."""
    verdict = evaluate_success(DEFAULT, steady) if steady else None
    return None if verdict is None else verdict.within


def outcome(words: str, completed: bool, within: bool | None) -> Html:
    """How a run ended, coloured by whether control succeeded; completing alone is no success.

    Args:
        words: what is said.
        completed: whether the run reached its end.
        within: whether it kept to the criterion; None where it has none.
    """
    return tag("span", words, class_=f"chip {_CLASSES[within] if completed else 'fails'}")


def ending(entry: Mapping[str, Any]) -> str:
    """Status of a run, with the time if it ended early."""
    word = str(entry.get("status", "completed")).replace("_", " ")
    when = entry.get("diverged_at")
    return word if when is None else f"{word} at {when:.3g} s"


def round_time(seconds: float) -> str:
    """Three digits, but whole seconds from 100 s on."""
    return f"{seconds:.0f}" if seconds >= 100 else f"{seconds:.3g}"


def captioned(vectors: Mapping[str, Path], captions: Mapping[str, str]) -> dict[str, Html]:
    """Figures that were saved as SVG, by name, each with its caption, which also says what it shows."""
    return {
        name: figure(vector.read_text(encoding="utf-8"), name, captions[name], prose(captions[name]))
        for name, vector in vectors.items()
    }
