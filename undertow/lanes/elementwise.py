"""JAX's primitives that work entry by entry, on scalars."""

from collections.abc import Callable
from functools import partial, reduce
from typing import Any

from undertow.lanes import functions
from undertow.lanes.graph import BOOL, Graph, Node
from undertow.lanes.inverse_error import erf_inv
from undertow.lanes.scalar import Scalar, larger, smaller, where

# From a graph and nodes of operands to the node of the result.
Rule = Callable[..., Node]


def rule(name: str, params: dict[str, Any], dtype: str) -> Rule | None:
    """The rule of a primitive, None where there is none.

    Args:
        name: of the primitive.
        params: of the equation.
        dtype: of its result.
    """
    if name in _SAME:
        return lambda graph, *nodes: graph.apply(_SAME[name], *nodes)
    if name in _FORMULAS:
        formula = _FORMULAS[name]
        return lambda graph, *nodes: formula(*(Scalar(graph, node) for node in nodes)).node
    if name in _TYPED:
        return lambda graph, node: _TYPED[name](Scalar(graph, node), dtype).node
    if name == "integer_pow":
        return lambda graph, node: _integer_power(Scalar(graph, node), params["y"]).node
    return None


def on(graph: Graph, name: str) -> Rule:
    """The rule of a primitive that has one and needs no parameters, on a graph."""
    found = rule(name, {}, "")
    assert found is not None, name
    return partial(found, graph)


def _sign(x: Scalar) -> Scalar:
    return where(x > 0, 1, where(x < 0, x.constant(-1), x))


def _absolute(x: Scalar) -> Scalar:
    return abs(x) if x.type.startswith("float") else where(x < 0, -x, x)


def _select(which: Scalar, *cases: Scalar) -> Scalar:
    if which.type == BOOL:
        return where(which, cases[1], cases[0])
    return reduce(lambda rest, i: where(which.equal(i), cases[i], rest), range(1, len(cases)), cases[0])


def _shifted(x: Scalar, by: Scalar, kind: str) -> Scalar:
    """To the right as whole numbers of a kind: with a sign or without."""
    other = kind + x.type.removeprefix("u").removeprefix("int")
    if other == x.type:
        return x >> by
    return (x.to("bits", other) >> by.to("bits", other)).to("bits", x.type)


def _not(x: Scalar) -> Scalar:
    return x ^ (True if x.type == BOOL else -1)


def _convert(x: Scalar, dtype: str) -> Scalar:
    if x.type == dtype:
        return x
    return x.apply("ne", 0) if dtype == BOOL else x.to("convert", dtype)


def _integer_power(x: Scalar, exponent: int) -> Scalar:
    """By squaring."""
    left, result = abs(exponent), None
    while left:
        if left & 1:
            result = x if result is None else result * x
        left >>= 1
        x = x * x if left else x
    result = x.constant(1) if result is None else result
    return 1.0 / result if exponent < 0 else result


_SAME = {name: name for name in "add sub mul div rem neg sqrt floor ceil lt le gt ge eq ne and or xor select".split()}
_SAME |= {"add_any": "add", "round": "round", "lt_to": "lt", "shift_left": "shift_left"}

_FORMULAS: dict[str, Callable[..., Scalar]] = {
    "abs": _absolute,
    "max": larger,
    "min": smaller,
    "clamp": lambda low, x, high: smaller(larger(x, low), high),
    "sign": _sign,
    "not": _not,
    "square": lambda x: x * x,
    "one_minus_square": lambda x: 1.0 - x * x,
    "rsqrt": lambda x: 1.0 / x.apply("sqrt"),
    "is_finite": lambda x: abs(x) < float("inf"),
    "select_n": _select,
    "pow": functions.power,
    "exp2": lambda x: functions.exp(x * 0.6931471805599453),
    "logistic": lambda x: 1.0 / (functions.exp(-x) + 1.0),
    "stop_gradient": lambda x: x,
    "copy": lambda x: x,
    "erf_inv": erf_inv,
    "shift_right_logical": lambda x, by: _shifted(x, by, "uint"),
    "shift_right_arithmetic": lambda x, by: _shifted(x, by, "int"),
}
_FORMULAS |= {
    name: getattr(functions, name)
    for name in "exp expm1 log log1p sin cos tan asin acos atan atan2 sinh cosh tanh".split()
}

_TYPED: dict[str, Callable[[Scalar, str], Scalar]] = {
    "convert_element_type": _convert,
    "bitcast_convert_type": lambda x, dtype: x if x.type == dtype else x.to("bits", dtype),
}
