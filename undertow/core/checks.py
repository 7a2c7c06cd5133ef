"""Checks of parameter values at construction.

Traced values pass, because their numbers were checked before tracing. Where they were not, as when a campaign traces
how the numbers of its trials follow from the varied values, the checks are recorded as conditions on traced values.
"""

import contextlib
from collections.abc import Callable, Iterator
from contextvars import ContextVar
from typing import Any, NamedTuple

import jax.numpy as jnp
import numpy as np
from jax.core import Tracer
from jax.extend.core import get_opaque_trace_state

from undertow.core.errors import BadInput


class _Record(NamedTuple):
    """Conditions on the values of one trace."""

    conditions: list[Any]
    trace: Any  # JAX's state: functions that are traced within have another, and their values were checked outside


_record: ContextVar[_Record | None] = ContextVar("undertow_conditions", default=None)

# Share of the largest eigenvalue by which a recorded matrix has to be definite: LAPACK decides within rounding.
_CLEARLY = 1e-9


class Unknown(Exception):
    """A constructor needs the number of a traced value."""


@contextlib.contextmanager
def recorded_conditions() -> Iterator[list[Any]]:
    """Inside, every check of a traced value becomes a condition in this list: a traced boolean."""
    record = _Record([], get_opaque_trace_state())
    outside = _record.set(record)
    try:
        yield record.conditions
    finally:
        _record.reset(outside)


def _recorded() -> list[Any] | None:
    """The list of conditions on values of the present trace; None where none are recorded."""
    record = _record.get()
    return record.conditions if record is not None and record.trace == get_opaque_trace_state() else None


def traced(*values: Any) -> bool:
    """Whether some of the values, or of the entries of lists, are traced."""
    return any(traced(*value) if isinstance(value, list | tuple) else isinstance(value, Tracer) for value in values)


def known(*values: Any) -> bool:
    """Whether a constructor may look at the numbers of values: not while they are traced.

    Raises:
        Unknown: conditions are recorded, and what the constructor would find out cannot be.
    """
    if traced(*values) and _recorded() is not None:
        raise Unknown
    return not traced(*values)


def assumed(condition: Callable[..., Any], *values: Any) -> bool:
    """Whether a condition holds of values; one on traced values is taken to hold, and recorded.

    Args:
        condition: gives one boolean for arrays, of NumPy or traced.
        values: numbers or arrays.
    """
    if not traced(*values):
        return bool(condition(*map(np.asarray, values)))
    if (conditions := _recorded()) is not None:
        conditions.append(condition(*map(jnp.asarray, values)))
    return True


def positive(name: str, value: Any, unit: str = "", finite: bool = True) -> None:
    """Check that every entry is > 0, and finite unless `finite` is False."""
    _each(name, value, lambda x: (x > 0) & ((abs(x) < np.inf) | (not finite)), "be positive", unit)


def not_negative(name: str, value: Any, unit: str = "", finite: bool = True) -> None:
    """Check that every entry is >= 0, and finite unless `finite` is False."""
    _each(name, value, lambda x: (x >= 0) & ((abs(x) < np.inf) | (not finite)), "be zero or positive", unit)


def finite(name: str, value: Any, unit: str = "") -> None:
    """Check that every entry is finite."""
    _each(name, value, lambda x: abs(x) < np.inf, "be a finite number", unit)


def rows_over_time(name: str, rows: Any, columns: str, width: int | None = None) -> None:
    """Check rows of a time and other numbers: two or more of them, finite, with times that increase.

    Args:
        name: of the value.
        rows: shape (rows, columns).
        columns: their names, for messages.
        width: number of columns; None for two or more.
    """
    shape = np.shape(rows)
    if len(shape) != 2 or shape[0] < 2 or (shape[1] < 2 if width is None else shape[1] != width):
        raise BadInput(name, f"have two or more rows ({columns})", f"of shape {shape}")
    finite(name, rows)
    if known(rows):
        steps = np.diff(np.asarray(rows)[:, 0])
        if not (steps > 0).all():
            raise BadInput(name, "have increasing times", f"row {int(np.argmin(steps > 0)) + 2} too early")


def numbers(name: str, value: Any, shape: tuple[int, ...]) -> np.ndarray:
    """A value as numbers of a shape.

    Raises:
        BadInput: it has another one, or holds something else.
    """
    try:
        if np.asarray(value).dtype.kind in "SU":  # NumPy takes "10" for a number
            raise TypeError
        array = np.asarray(value, dtype=float)
    except (TypeError, ValueError, OverflowError):
        raise BadInput(name, "be numbers" if shape else "be a number", repr(value)) from None
    if array.shape != shape:
        raise BadInput(name, f"have shape {shape}", f"of shape {array.shape}")
    return array


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
    finite(name, feedback)
    if traced(feedback):
        assumed(lambda gains: (gains > 0).all(), feedback)
        return
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
    finite(name, matrix, unit)
    if traced(matrix):
        assumed(_clearly_definite, matrix)
        return
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


def _clearly_definite(matrices: Any) -> Any:
    """Whether traced matrices are symmetric and positive definite, rounding errors aside."""
    largest = abs(matrices).max((-2, -1))
    even = abs(matrices - jnp.swapaxes(matrices, -2, -1)).max((-2, -1)) <= _CLEARLY / 2 * largest
    return (even & (jnp.linalg.eigvalsh(matrices).min(-1) > _CLEARLY * largest)).all()


def _each(name: str, value: Any, good: Callable[[Any], Any], must: str, unit: str) -> None:
    if traced(value):
        assumed(lambda numbers: good(numbers).all(), value)
        return
    array = np.asarray(value)
    bad = ~good(array)
    if bad.any():
        index = tuple(int(i) for i in np.argwhere(bad)[0])
        at = f"[{', '.join(map(str, index))}]" if index else ""
        raise BadInput(f"{name}{at}", must, f"{array[index]:g} {unit}".strip())
