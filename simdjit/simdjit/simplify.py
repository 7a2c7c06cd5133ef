"""What is known of a result without computing it in every lane."""

from collections.abc import Callable
from fractions import Fraction
from math import inf, nextafter
from typing import Any

import numpy as np


def _whole(number: Any, dtype: str) -> Any:
    """A number of any type as a whole one: the nearest there is, and 0 for what is no number."""
    if number.dtype.kind != "f":
        return number.astype(dtype)
    limits = np.iinfo(dtype)
    if np.isfinite(number):
        return np.array(min(max(int(number), limits.min), limits.max), dtype=dtype)[()]
    return np.array(limits.max if number > 0 else limits.min if number < 0 else 0, dtype=dtype)[()]


def _quotient(a: Any, b: Any, _: str) -> Any:
    """Of whole numbers towards zero; see `elementwise` for what it is never asked."""
    if a.dtype.kind == "f":
        return a / b
    return np.array(abs(int(a)) // abs(int(b)) * (1 if (a < 0) == (b < 0) else -1), dtype=a.dtype)[()]


def _fused(a: Any, b: Any, c: Any, _: str) -> Any:
    """a b + c, rounded once; in single precision by a double that is rounded to odd (S. Boldo, G. Melquiond, 2008)."""
    if not (np.isfinite(a) and np.isfinite(b) and np.isfinite(c)):
        return a * b + c
    exact = Fraction(float(a)) * Fraction(float(b)) + Fraction(float(c))
    if exact == 0:
        return a * b + c
    try:
        near = float(exact)
    except OverflowError:
        near = inf if exact > 0 else -inf
    if a.dtype == np.float32 and exact != near and np.float64(near).view(np.int64) % 2 == 0:
        near = nextafter(near, inf if exact > near else -inf)
    return a.dtype.type(near)


# What each operation gives for numbers and the type of its result: the same bits as the machine's instruction.
RESULTS: dict[str, Callable[..., Any]] = {
    "add": lambda a, b, _: a + b,
    "sub": lambda a, b, _: a - b,
    "mul": lambda a, b, _: a * b,
    "fma": _fused,
    "div": _quotient,
    "rem": lambda a, b, _: np.fmod(a, b),
    "neg": lambda a, _: -a,
    "abs": lambda a, _: abs(a),
    "copysign": lambda a, b, _: np.copysign(a, b),
    "sqrt": lambda a, _: np.sqrt(a),
    "floor": lambda a, _: np.floor(a),
    "ceil": lambda a, _: np.ceil(a),
    "round": lambda a, _: np.rint(a),
    "lt": lambda a, b, _: a < b,
    "le": lambda a, b, _: a <= b,
    "gt": lambda a, b, _: a > b,
    "ge": lambda a, b, _: a >= b,
    "eq": lambda a, b, _: a == b,
    "ne": lambda a, b, _: a != b,
    "and": lambda a, b, _: a & b,
    "or": lambda a, b, _: a | b,
    "xor": lambda a, b, _: a ^ b,
    "shift_left": lambda a, b, _: a << b,
    "shift_right": lambda a, b, _: a >> b,
    "select": lambda which, a, b, _: a if which else b,
    "convert": lambda a, dtype: a.astype(dtype) if dtype.startswith("float") else _whole(a, dtype),
    "bits": lambda a, dtype: a.view(dtype),
}
COMPARISONS = frozenset(("lt", "le", "gt", "ge", "eq", "ne"))


def simpler(graph: Any, name: str, nodes: tuple[int, ...], values: list[Any]) -> int | None:
    """A node that is the same as an operation on others, None where it has to be done.

    For numbers that are finite: a product with a constant zero is zero, and a sum with one is the other number. So
    neither the sign of a zero is kept nor what infinity or no number times a constant zero becomes: models are full
    of such zeros (a fifth of all operations), and a run that overflows is at its end anyway.
    """
    rule = _RULES.get(name)
    return rule(graph, nodes, values) if rule else None


def _is(value: Any, number: float) -> bool:
    return value is not None and value == number


def _negated(graph, node) -> int | None:
    """What a node is the negative of."""
    operation = graph.operations[node]
    return operation.operands[0] if operation.name == "neg" else None


def _add(graph, nodes, values):
    for value, operand, other in ((values[0], *nodes), (values[1], *nodes[::-1])):
        if _is(value, 0):
            return other
        if (minus := _negated(graph, operand)) is not None:
            return graph.apply("sub", other, minus)
    return None


def _sub(graph, nodes, values):
    if _is(values[1], 0):
        return nodes[0]
    if (minus := _negated(graph, nodes[1])) is not None:
        return graph.apply("add", nodes[0], minus)
    return graph.apply("neg", nodes[1]) if _is(values[0], 0) else None


def _mul(graph, nodes, values):
    for value, operand, other in ((values[0], *nodes), (values[1], *nodes[::-1])):
        if value is None:
            continue
        if _is(value, 0):
            return operand
        if _is(value, 1):
            return other
        if _is(value, -1):
            return graph.apply("neg", other)
    minus = [_negated(graph, node) for node in nodes]
    return None if None in minus else graph.apply("mul", *minus)


def _fma(graph, nodes, values):
    if _is(values[0], 0) or _is(values[1], 0):
        return nodes[2]
    return graph.apply("mul", *nodes[:2]) if _is(values[2], 0) else None


def _div(graph, nodes, values):
    if _is(values[1], 1):
        return nodes[0]
    if values[1] is not None and values[1].dtype.kind == "f" and 1e-30 < abs(values[1]) < 1e30:
        if abs(np.frexp(values[1])[0]) == 0.5:  # a power of two: the product is the quotient to the last bit
            return graph.apply("mul", nodes[0], graph.like(1 / values[1], nodes[1]))
    return None


def _neg(graph, nodes, values):
    return _negated(graph, nodes[0])


def _abs(graph, nodes, values):
    if (minus := _negated(graph, nodes[0])) is not None:
        return graph.apply("abs", minus)
    return nodes[0] if graph.operations[nodes[0]].name == "abs" else None


def _select(graph, nodes, values):
    if values[0] is not None:
        return nodes[1] if values[0] else nodes[2]
    return nodes[1] if nodes[1] == nodes[2] else None


def _decided_by(deciding: bool):
    """Of two truths, one of which may decide."""

    def rule(graph, nodes, values):
        for value, operand, other in zip(values, nodes, reversed(nodes), strict=True):
            if value is not None and graph.types[operand] == "bool":
                return operand if bool(value) is deciding else other
        return nodes[0] if nodes[0] == nodes[1] else None

    return rule


_RULES: dict[str, Callable[..., int | None]] = {
    "add": _add,
    "sub": _sub,
    "mul": _mul,
    "fma": _fma,
    "div": _div,
    "neg": _neg,
    "abs": _abs,
    "select": _select,
    "and": _decided_by(False),
    "or": _decided_by(True),
}
