"""Numbers as files have them: Python takes more for a number than other programs do, such as 1_000 and other digits."""

import math
import re

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
