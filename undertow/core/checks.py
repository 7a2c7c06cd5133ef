"""Checks of parameter values at construction, and of options by their annotation.

Traced values pass: their numbers were checked before tracing.
"""

import math
import typing
from typing import Any

import numpy as np
from jax.core import Tracer

from undertow.core.errors import BadInput

_WORDS = {bool: "true or false", int: "an integer", float: "a number", str: "text", type(None): "null"}
# Integers are sizes and counts that compiled code is unrolled over.
_LARGEST_COUNT = 100


def positive(name: str, value: Any, unit: str = "", finite: bool = True) -> None:
    """Check that every entry is > 0, and finite unless `finite` is False."""
    _each(name, value, lambda x: (x > 0) & (np.isfinite(x) | (not finite)), "be positive", unit)


def not_negative(name: str, value: Any, unit: str = "", finite: bool = True) -> None:
    """Check that every entry is >= 0, and finite unless `finite` is False."""
    _each(name, value, lambda x: (x >= 0) & (np.isfinite(x) | (not finite)), "be zero or positive", unit)


def finite(name: str, value: Any, unit: str = "") -> None:
    """Check that every entry is finite."""
    _each(name, value, np.isfinite, "be a finite number", unit)


def length(name: str, value: Any, expected: int, what: str) -> None:
    """Check that a value is one-dimensional with `expected` entries."""
    shape = np.shape(value)
    if shape != (expected,):
        got = f"{shape[0]} long" if len(shape) == 1 else f"of shape {shape}" if shape else f"one number, {value}"
        raise BadInput(name, f"have {expected} entries ({what})", got)


def per_axis(name: str, value: Any, axes: int, entry: tuple[int, ...] = ()) -> None:
    """Check that a value is one entry of shape `entry`, or one such entry per axis."""
    shape = np.shape(value)
    if shape not in (entry, (axes, *entry)):
        what = "one number" if not entry else f"one entry of shape {entry}"
        raise BadInput(name, f"be {what}, or {axes} of them, one per axis", f"of shape {shape}")


def choice(name: str, value: Any, allowed: tuple[str, ...]) -> None:
    """Check that a value is one of the allowed words."""
    if value not in allowed:
        raise BadInput(name, f"be one of {', '.join(allowed)}", value)


def hurwitz(name: str, feedback: Any) -> None:
    """Check that gains (k1, k2), one pair or one per axis, make s^2 + k2 s + k1 stable."""
    if isinstance(feedback, Tracer):
        return
    finite(name, feedback)
    for k1, k2 in np.asarray(feedback).reshape(-1, 2):
        if not (k1 > 0 and k2 > 0):
            raise BadInput(
                name,
                "make the error dynamics Hurwitz",
                f"({k1:g}, {k2:g})",
                hint="Both k1 and k2 must be positive, as in Table 1: (1, 2)",
            )


def positive_definite(name: str, matrix: Any, unit: str = "") -> None:
    """Check that a square matrix, or each of a stack, is symmetric with positive eigenvalues."""
    shape = np.shape(matrix)
    if isinstance(matrix, Tracer):
        return
    finite(name, matrix, unit)
    for block in np.asarray(matrix).reshape(-1, *shape[-2:]):
        skew = np.abs(block - block.T).max()
        if skew > 1e-9 * np.abs(block).max():
            raise BadInput(name, "be symmetric", f"off by {skew:.3g} {unit}".strip())
        smallest = float(np.linalg.eigvalsh(block).min())
        if not smallest > 0:
            raise BadInput(name, "be positive definite", f"a matrix with smallest eigenvalue {smallest:.3g}")


def option(name: str, value: Any, hint: Any, default: Any) -> Any:
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
    kinds = typing.get_args(hint) or (hint,)
    plain = all(kind in _WORDS for kind in kinds)
    if not (any(_is(value, kind) for kind in kinds) if plain else _numbers(value)):
        must = " or ".join(_WORDS[kind] for kind in kinds) if plain else "a number or a list of numbers"
        raise BadInput(name, f"be {must}", repr(value))
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


def _is(value: Any, kind: type) -> bool:
    """Whether a value is of a kind: integers are numbers, but true and false are neither."""
    return isinstance(value, (int, float) if kind is float else kind) and (kind is bool or not isinstance(value, bool))


def _numbers(value: Any, depth: int = 3) -> bool:
    """Whether a value is a number, or lists of numbers to a depth."""
    if isinstance(value, list):
        return depth > 0 and all(_numbers(one, depth - 1) for one in value)
    return _is(value, float)


def _each(name: str, value: Any, good: Any, must: str, unit: str) -> None:
    if isinstance(value, Tracer):
        return
    array = np.asarray(value)
    bad = ~good(array)
    if bad.any():
        index = tuple(int(i) for i in np.argwhere(bad)[0])
        at = f"[{', '.join(map(str, index))}]" if index else ""
        raise BadInput(f"{name}{at}", must, f"{array[index]:g} {unit}".strip())
