"""Numbers as files, tables and figures have them.

In files Python takes more for a number than other programs do, such as 1_000 and other digits.
"""

import math
import re

DIGITS = 3  # significant ones
SMALL, LARGE = 1e-3, 1e5  # outside of these a number is written with a power of ten

_RAISED = str.maketrans("-0123456789", "\u207b\u2070\u00b9\u00b2\u00b3\u2074\u2075\u2076\u2077\u2078\u2079")
_NUMBER = re.compile(r"[+-]?([0-9]+\.?[0-9]*|\.[0-9]+)([eE][+-]?[0-9]+)?")
_NONE = re.compile(r"[+-]?(nan|inf|infinity)", re.IGNORECASE)


def number_in(text: str) -> float:
    """The number that a text is; nan, inf and infinity as well.

    Raises:
        ValueError: it is none, or one that no floating-point number holds.
    """
    if _NONE.fullmatch(text):
        return float(text)
    if not _NUMBER.fullmatch(text):
        raise ValueError(f"not a number: {text}")
    number = float(text)
    if math.isinf(number):
        raise ValueError(f"too large: {text}")
    return number


def display_units(value: float, unit: str) -> tuple[float, str]:
    """A value and its unit as tables show them: angles in degrees."""
    return (math.degrees(value), "deg") if unit == "rad" else (value, unit)


def infinite(unit: str) -> str:
    """What tables say in place of an infinite value: a time that does not come is `never`."""
    return "never" if unit == "s" else "inf"


def plain(value: float, digits: int = DIGITS) -> str:
    """A number as text, for figures; whole numbers have no zeros after the point."""
    if value and not SMALL <= abs(value) < LARGE:
        mantissa, exponent = f"{value:.{digits - 1}e}".split("e")
        return f"{with_minus(mantissa)} \u00d7 10{str(int(exponent)).translate(_RAISED)}"
    is_integer = float(value).is_integer() or abs(value) >= 10 ** (digits - 0.5)
    return with_minus(f"{value:.0f}" if is_integer else f"{value:#.{digits}g}".rstrip("."))


def counted(number: int, what: str) -> str:
    """A number of things, in words: `1 error`, `2 errors`."""
    return f"{number} {what}{'' if number == 1 else 's'}"


def with_minus(value: str) -> str:
    """With a typographic minus sign."""
    return value.replace("-", "\u2212")
