"""JAX's primitives that work entry by entry, on scalars."""

from collections.abc import Callable
from functools import partial, reduce
from typing import Any

import numpy as np

from simdjit import functions, powers
from simdjit.graph import BOOL, Graph, Node, Nodes, Unsupported, filled
from simdjit.inverse_erf import erf_inv
from simdjit.rules import Equation, rule
from simdjit.scalar import Scalar, larger, smaller, where


def _entrywise(name: str, formula: Callable[..., Scalar], reads: str = "", idle: str = "") -> None:
    """Register a formula of scalars; it is given by name the parameters that it reads."""

    @rule(name, reads=reads, idle=idle)
    def entries(equation: Equation, *operands: Nodes) -> Nodes:
        graph, shape = equation.graph, equation.shape
        spread = (nodes if nodes.shape == shape else np.broadcast_to(nodes, shape) for nodes in operands)
        rows = zip(*(nodes.ravel().tolist() for nodes in spread), strict=True)
        if name in _OPERATIONS and equation.dtype != BOOL:  # nearly all: without a `Scalar` for each operand
            operation = _OPERATIONS[name]
            return filled(shape, [graph.apply(operation, *row) for row in rows])
        chosen = partial(formula, **{key: equation.params[key] for key in reads.split()})
        scalars = ((Scalar(graph, node) for node in row) for row in rows)
        return filled(shape, [chosen(*row).node for row in scalars])


def on(graph: Graph, name: str) -> Callable[..., Node]:
    """The formula of a primitive that needs no parameters, on nodes of a graph."""
    return lambda *nodes: FORMULAS[name](*(Scalar(graph, node) for node in nodes)).node


def _operation(name: str) -> Callable[..., Scalar]:
    return lambda first, *others: first.apply(name, *others)


def _arithmetic(name: str) -> Callable[..., Scalar]:
    def formula(*operands: Scalar) -> Scalar:
        if operands[0].type == BOOL:
            raise Unsupported(f"`{name}` of truths")
        return operands[0].apply(name, *operands[1:])

    return formula


def _quotient(a: Scalar, b: Scalar) -> Scalar:
    """Of whole numbers as XLA has it, where a processor would stop: all bits by zero; the least by -1 itself."""
    if b.type.startswith("float"):
        return a.apply("div", b)
    quotient = where(b.equal(0), b.constant(-1), a // _divisor(b))
    return where(b.equal(-1), -a, quotient) if b.type.startswith("int") else quotient


def _remainder(a: Scalar, b: Scalar) -> Scalar:
    if b.type.startswith("float"):
        return a.apply("rem", b)
    remainder = where(b.equal(0), a, a.apply("rem", _divisor(b)))
    return where(b.equal(-1), 0, remainder) if b.type.startswith("int") else remainder


def _divisor(b: Scalar) -> Scalar:
    """A whole number that one can divide by without harm."""
    harm = b.equal(0) | b.equal(-1) if b.type.startswith("int") else b.equal(0)
    return where(harm, 1, b)


def _sign(x: Scalar) -> Scalar:
    return where(x > 0, 1, where(x < 0, x.constant(-1), x))


def _absolute(x: Scalar) -> Scalar:
    return abs(x) if x.type.startswith("float") else where(x < 0, -x, x)


def _select(which: Scalar, *cases: Scalar) -> Scalar:
    if which.type == BOOL:
        return where(which, cases[1], cases[0]) if len(cases) == 2 else cases[0]
    return reduce(lambda rest, i: where(which.equal(i), cases[i], rest), range(1, len(cases)), cases[0])


def _unsigned(x: Scalar) -> Scalar:
    return x if x.type.startswith("u") else x.to("bits", f"u{x.type}")


def _shifted(x: Scalar, by: Scalar, name: str) -> Scalar:
    """To the left or the right as bits; nothing is left beyond the last one."""
    size = np.dtype(x.type).itemsize * 8
    inside = _unsigned(by) < size
    found = _unsigned(x).apply(name, where(inside, _unsigned(by), 0)).to("bits", x.type)
    return where(inside, found, 0)


def _shifted_with_sign(x: Scalar, by: Scalar) -> Scalar:
    most = np.dtype(x.type).itemsize * 8 - 1
    signed = x.to("bits", x.type.removeprefix("u"))
    return (signed >> smaller(_unsigned(by), most).to("bits", signed.type)).to("bits", x.type)


def _not(x: Scalar) -> Scalar:
    return x ^ (True if x.type == BOOL else -1)


def _in_order(name: str) -> Callable[[Scalar, Scalar], Scalar]:
    """A comparison of all numbers there are in one order: -0 before 0, and what is no number at the ends."""

    def key(x: Scalar) -> Scalar:
        if not x.type.startswith("float"):
            return x
        bits = x.to("bits", x.type.replace("float", "int"))
        return where(bits < 0, bits ^ np.iinfo(bits.type).max, bits)

    return lambda a, b: key(a).apply(name, key(b))


def _rounded(x: Scalar, rounding_method: Any) -> Scalar:
    """To whole numbers; halves away from zero (0) or to even ones (1)."""
    if int(rounding_method) == 1:
        return x.apply("round")
    below_half = np.nextafter(np.dtype(x.type).type(0.5), 0)
    return (abs(x) + below_half).apply("floor").signed(x)


def _convert(x: Scalar, new_dtype: Any) -> Scalar:
    dtype = str(new_dtype)
    return x.apply("ne", 0) if dtype == BOOL != x.type else x.to("convert", dtype)


def _reread(x: Scalar, new_dtype: Any) -> Scalar:
    """Whatever is no number has the same bits: those that it is given differ from instruction to instruction, and so
    from one number of lanes to another."""
    dtype = str(new_dtype)
    if np.dtype(x.type).itemsize != np.dtype(dtype).itemsize:
        raise Unsupported(f"bits of {x.type} as {dtype}")
    bits = x.to("bits", dtype)
    if not x.type.startswith("float") or dtype == x.type:
        return bits
    return where(x.apply("ne", x), int(np.array(np.nan, x.type).view(dtype)), bits)


def _integer_power(x: Scalar, y: int) -> Scalar:
    """By squaring."""
    left, result = abs(y), None
    while left:
        if left & 1:
            result = x if result is None else result * x
        left >>= 1
        x = x * x if left else x
    result = x.constant(1) if result is None else result
    return 1.0 / result if y < 0 else result


# Primitives of numbers that are one operation of the graph each.
_ARITHMETIC = {"add": "add", "sub": "sub", "mul": "mul", "neg": "neg", "add_any": "add"}
_OPERATIONS = _ARITHMETIC | {name: name for name in ("sqrt", "floor", "ceil")}

FORMULAS: dict[str, Callable[..., Scalar]] = {
    **{name: _arithmetic(operation) for name, operation in _ARITHMETIC.items()},
    **{name: _operation(name) for name in "sqrt floor ceil lt le gt ge eq ne and or xor".split()},
    "div": _quotient,
    "rem": _remainder,
    "abs": _absolute,
    "max": larger,
    "min": smaller,
    "clamp": lambda low, x, high: smaller(larger(x, low), high),
    "lt_to": _in_order("lt"),
    "le_to": _in_order("le"),
    "sign": _sign,
    "not": _not,
    "square": lambda x: x * x,
    "one_minus_square": lambda x: 1.0 - x * x,
    "rsqrt": lambda x: 1.0 / x.apply("sqrt"),
    "is_finite": lambda x: abs(x) < float("inf"),
    "select_n": _select,
    "pow": powers.power,
    "exp2": powers.exp2,
    "cbrt": powers.cbrt,
    "logistic": lambda x: 1.0 / (functions.exp(-x) + 1.0),
    "stop_gradient": lambda x: x,
    "copy": lambda x: x,
    "erf_inv": erf_inv,
    "shift_left": lambda x, by: _shifted(x, by, "shift_left"),
    "shift_right_logical": lambda x, by: _shifted(x, by, "shift_right"),
    "shift_right_arithmetic": _shifted_with_sign,
    **{
        name: getattr(functions, name)
        for name in ("exp expm1 log log1p sin cos tan asin acos atan atan2 sinh cosh tanh asinh acosh atanh".split())
    },
}
for _name, _formula in FORMULAS.items():
    _entrywise(_name, _formula)
_entrywise("round", _rounded, reads="rounding_method")
_entrywise("integer_pow", _integer_power, reads="y")
_entrywise("convert_element_type", _convert, reads="new_dtype", idle="weak_type")
_entrywise("bitcast_convert_type", _reread, reads="new_dtype")
