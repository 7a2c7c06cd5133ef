"""Checks of parameter values at construction. Traced values pass: their numbers were checked before tracing."""

from typing import Any

import numpy as np
from jax.core import Tracer

from undertow.core.errors import BadInput


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


def positive_definite(name: str, matrix: Any, unit: str = "", whole: str = "", hint: str = "") -> None:
    """Check that a square matrix, or each of a stack, is symmetric with positive eigenvalues.

    Args:
        name: of the value.
        matrix: the value, or a matrix that it is a part of.
        unit: of its entries.
        whole: what the matrix is, where the value is a part of it.
        hint: remedy where an eigenvalue is not positive.
    """
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
            if whole:
                got = f"such that its smallest eigenvalue is {smallest:.3g}"
                raise BadInput(name, f"leave {whole} positive definite", got, hint=hint)
            raise BadInput(name, "be positive definite", f"a matrix with smallest eigenvalue {smallest:.3g}", hint=hint)


def _each(name: str, value: Any, good: Any, must: str, unit: str) -> None:
    if isinstance(value, Tracer):
        return
    array = np.asarray(value)
    bad = ~good(array)
    if bad.any():
        index = tuple(int(i) for i in np.argwhere(bad)[0])
        at = f"[{', '.join(map(str, index))}]" if index else ""
        raise BadInput(f"{name}{at}", must, f"{array[index]:g} {unit}".strip())
