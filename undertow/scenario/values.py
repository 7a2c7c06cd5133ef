"""Check the value of an option against its annotation."""

import math
import re
import typing
from typing import Any

import numpy as np

from undertow.core import checks
from undertow.core.errors import BadInput

_WORDS = {bool: "true or false", int: "an integer", float: "a number", str: "text", type(None): "null"}
# Integers are sizes and counts that compiled code is unrolled over.
_LARGEST_COUNT = 100

_NUMBER = re.compile(r"[-+]?(\d+\.?\d*|\.\d+)([eE][-+]?\d+)?")
_PI = re.compile(r"([-+]?)(?:(\d+\.?\d*)\*?)?pi(?:/(\d+\.?\d*))?")


def checked(name: str, value: Any, hint: Any, default: Any) -> Any:
    """The value of an option, if it is of the annotated type; numbers finite unless the default is infinite.

    Args:
        name: of the option.
        value: as read from a scenario.
        hint: its annotation; anything but plain words and numbers means numbers or lists of them.
        default: of the option.

    Raises:
        BadInput: it is not.
    """
    if value is None and default is None:
        return None
    if checks.traced(value):  # a campaign traces numbers that vary
        _check_traced(name, value, hint)
        return value
    kinds = typing.get_args(hint) or (hint,)
    plain = all(kind in _WORDS for kind in kinds)
    if not (any(_is(value, kind) for kind in kinds) if plain else _numbers(value)):
        must = " or ".join(_WORDS[kind] for kind in kinds) if plain else "a number or a list of numbers"
        remedy = ("" if plain else _listed(value)) or remedy_of(value, bool in kinds)
        raise BadInput(name, f"be {must}", repr(value), hint=remedy)
    if int in kinds and value is not None and abs(value) > _LARGEST_COUNT:
        raise BadInput(name, f"be at most {_LARGEST_COUNT}", value)
    if not isinstance(value, str):
        try:
            numbers = np.asarray(value, dtype=float)
        except (ValueError, OverflowError):
            raise BadInput(name, "have rows of equal length and numbers of ordinary size", value) from None
        endless = isinstance(default, float) and math.isinf(default)
        if np.isnan(numbers).any() or (np.isinf(numbers).any() and not endless):
            raise BadInput(name, "be finite", value)
    return value


def _check_traced(name: str, value: Any, hint: Any) -> None:
    """Check that an option takes fractions and that a traced value is finite; its shape is that of any trial."""
    kinds = typing.get_args(hint) or (hint,)
    if float not in kinds and any(kind in _WORDS for kind in kinds):
        raise BadInput(name, f"be {' or '.join(_WORDS[kind] for kind in kinds)}", value)
    checks.finite(name, value)


def remedy_of(value: Any, yes_or_no: bool = False) -> str:
    """How to write what was meant as a number, or as true or false; "" where that is unknown."""
    if isinstance(value, list):
        return next(filter(None, map(remedy_of, value)), "")
    if not isinstance(value, str) or yes_or_no:
        return "Write it without quotes" if yes_or_no and str(value).lower() in ("true", "false") else ""
    text = value.strip()
    if _NUMBER.fullmatch(text):
        return f"Write it without quotes: {text}"
    if _NUMBER.fullmatch(text.replace(",", ".", 1)):
        return f"Write a decimal point: {text.replace(',', '.')}"
    if turn := _PI.fullmatch(text.replace(" ", "")):
        size = float(turn[2] or 1) * math.pi / float(turn[3] or 1)
        return f"Write the number: {turn[1]}{size:.6g}"
    if _NUMBER.match(text):
        return "Write the number alone, without a unit"
    return ""


def _listed(value: Any) -> str:
    """How to write a list that lacks its square brackets; "" where it is none."""
    inner = value.strip().strip("()") if isinstance(value, str) else ""
    entries = re.split(r",\s*|\s+", inner)
    has_several = len(entries) > 2 or (len(entries) == 2 and (" " in inner or inner != value.strip()))
    is_list_of_numbers = has_several and all(map(_NUMBER.fullmatch, entries))
    return f"Write it in square brackets, with commas: [{', '.join(entries)}]" if is_list_of_numbers else ""


def _is(value: Any, kind: type) -> bool:
    """Whether a value is of a kind: integers are numbers, but true and false are neither."""
    return isinstance(value, (int, float) if kind is float else kind) and (kind is bool or not isinstance(value, bool))


def _numbers(value: Any, depth: int = 3) -> bool:
    """Whether a value is a number, or lists of numbers to a depth."""
    if isinstance(value, list):
        return depth > 0 and all(_numbers(entry, depth - 1) for entry in value)
    return _is(value, float)
