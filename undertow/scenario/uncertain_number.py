"""Numbers with a standard deviation, as text: `13.5 +- 0.2`, or `13.5 +- 2 %`."""

import math
import re
from typing import Any, NamedTuple

from undertow.core.errors import BadInput

_MARKS = ("+-", "\u00b1")
_NUMBER = r"([-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?)"
_TEXT = re.compile(rf"\s*{_NUMBER}\s*(?:\+-|\u00b1)\s*(\S+?)\s*(%?)\s*")


class UncertainNumber(NamedTuple):
    """A value and its standard deviation, in the same unit."""

    value: float
    deviation: float


def uncertain_number(location: str, text: Any) -> UncertainNumber | None:
    """A number with a deviation; None for anything that is not text with `+-` or the sign for plus or minus.

    Args:
        location: key path, for messages.
        text: as a file has it.

    Raises:
        BadInput: text with such a mark that is no number with a positive, finite deviation.
    """
    if not isinstance(text, str) or not any(mark in text for mark in _MARKS):
        return None
    match = _TEXT.fullmatch(text)
    try:
        if match is None:
            raise ValueError
        value, deviation = float(match[1]), float(match[2])
    except ValueError:
        raise BadInput(location, "be `value +- deviation` or `value +- share %`", repr(text)) from None
    if match[3]:
        deviation *= abs(value) / 100
    if not (math.isfinite(value) and math.isfinite(deviation)):
        raise BadInput(location, "be finite, and so must its deviation", repr(text))
    if not deviation > 0:
        raise BadInput(
            location, "have a deviation above 0", repr(text), hint="Write the number alone where it is known"
        )
    return UncertainNumber(value, deviation)


def log_deviation(number: UncertainNumber) -> float:
    """Standard deviation of the logarithm of a positive number that is log-normal with the value as its median."""
    return math.sqrt(math.log1p((number.deviation / number.value) ** 2))
