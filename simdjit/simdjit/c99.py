"""A graph as C99: the same operations one after another, for one run, with the same bits in the same precision.

No heap, no state of its own, no library but libm: sqrt, floor and the like, which IEEE 754 rounds correctly, and fma
where the library rounds it once.
"""

import re
from collections.abc import Callable, Sequence
from typing import Any

import jax
import numpy as np

from simdjit.calls import ARGUMENT, FORMULAS
from simdjit.fused_c99 import FUSED
from simdjit.graph import BOOL, Graph, Node, Unsupported, flat
from simdjit.lowering import evaluate
from simdjit.matrix_loop import Product
from simdjit.prologue import inputs
from simdjit.scalar import Scalar
from simdjit.tracing import Traced

TYPES = {
    BOOL: "bool",
    "float64": "double",
    "float32": "float",
    "int64": "int64_t",
    "uint64": "uint64_t",
    "int32": "int32_t",
    "uint32": "uint32_t",
}

_OPERATORS = {"add": "+", "sub": "-", "mul": "*", "div": "/", "rem": "%", "and": "&", "or": "|", "xor": "^"}
_COMPARED = {"lt": "<", "le": "<=", "gt": ">", "ge": ">=", "eq": "==", "ne": "!="}
_TURNED = {"lt": "gt", "gt": "lt", "le": "ge", "ge": "le"}
_LIBM = {"rem": "fmod", "copysign": "copysign", "abs": "fabs", "sqrt": "sqrt"}
_LIBM |= {"floor": "floor", "ceil": "ceil", "round": "nearbyint"}

HEAD = """\
#include <float.h>
#include <math.h>
#include <stdbool.h>
#include <stdint.h>
#include <string.h>

#if defined(FLT_EVAL_METHOD) && FLT_EVAL_METHOD > 0
#error "Arithmetic must not be more precise than its types: compile for SSE2 or a floating-point unit of its own."
#endif
#if defined(__clang__)
#pragma STDC FP_CONTRACT OFF
#elif defined(__GNUC__)
#pragma GCC optimize("fp-contract=off")
#endif
"""


class Source:
    """Functions in C99, and what they need besides.

    Attributes:
        functions: text of each, helpers first.
    """

    def __init__(self) -> None:
        self.functions: list[str] = []
        self._known: set[str] = set()
        self._tables = 0

    def add(
        self,
        signature: str,
        function: Callable,
        arguments: tuple,
        read: Sequence[str],
        write: Sequence[str],
        idle: Sequence[str] = (),
    ) -> None:
        """A function of one run.

        Args:
            signature: everything before its body.
            function: of trees of arrays; anything that JAX can trace.
            arguments: examples of them.
            read: where each number of the arguments lies, in C.
            write: where each number of the results goes; everything is read before anything is written.
            idle: arguments that it may leave unused.

        Raises:
            Unsupported: the function needs something that the compiler has no rule for.
        """
        traced, graph = Traced(function, *arguments), Graph()
        given = inputs(graph, "number", jax.tree.leaves(arguments))
        results = flat(evaluate(graph, traced.closed, given))
        body = _Body(self, graph, lambda detail: str(read[detail[1]]))
        body.lines = [f"(void){name};" for name in idle]
        body.do([node for node, wanted in enumerate(graph.needed(results)) if wanted], None)
        stores = [f"{target} = {body.value(node)};" for node, target in zip(results, write, strict=True)]
        self.functions.append("\n".join([f"{signature} {{", *_indented([*body.lines, *stores]), "}"]))

    def helper(self, name: str, text: Callable[[], str]) -> str:
        """The name of a function that is written once."""
        if name not in self._known:
            self._known.add(name)
            self.functions.append(text())
        return name

    def called(self, name: str, dtype: str) -> str:
        """The name of a function of `calls`."""
        function_name = f"{name}_{dtype}"
        if function_name not in self._known:
            self._known.add(function_name)
            graph, kind = Graph(), TYPES[dtype]
            result = FORMULAS[name](Scalar(graph, graph.input(ARGUMENT, dtype))).node
            body = _Body(self, graph, lambda _: "x")
            body.do([node for node, wanted in enumerate(graph.needed([result])) if wanted], None)
            lines = _indented([*body.lines, f"return {body.value(result)};"])
            self.functions.append("\n".join([f"static {kind} {function_name}({kind} x) {{", *lines, "}"]))
        return function_name

    def table(self, dtype: str, entries: Sequence[str]) -> str:
        """The name of an array of constants."""
        self._tables += 1
        name = f"table{self._tables}"
        self.functions.append(f"static const {TYPES[dtype]} {name}[{len(entries)}] = {{{', '.join(entries)}}};")
        return name


class _Body:
    """Statements of a function."""

    def __init__(self, source: Source, graph: Graph, place: Callable[[Any], str], names: dict[Node, str] | None = None):
        self.lines: list[str] = []
        self._source, self._graph, self._place = source, graph, place
        self._names = {} if names is None else names
        self._results: dict[Node, list[str]] = {}

    def do(self, nodes: Sequence[Node], home: int | None) -> None:
        """Operations in order, those of one home."""
        graph = self._graph
        for node in nodes:
            if graph.homes[node] != home or node in self._names:
                continue
            name, operands, detail = graph.operations[node]
            if name == "constant":
                continue
            if name == "input":
                self.lines.append(f"const {TYPES[graph.types[node]]} v{node} = {self._place(detail)};")
                self._names[node] = f"v{node}"
            elif name == "region":
                self._region(node, operands, detail)
            elif name == "result":
                self._names[node] = self._results[operands[0]][detail]
            elif name == "table":
                self._table(node, operands)
            elif name == "product":
                self._product(node, operands, detail)
            elif name == "part":
                self._names[node] = f"{self._names[operands[0]]}[{detail}]"
            else:
                kind = TYPES[graph.types[node]]
                self.lines.append(f"const {kind} v{node} = {self._expression(node)};")
                self._names[node] = f"v{node}"

    def value(self, node: Node) -> str:
        """A node as an expression without operators."""
        name, _, detail = self._graph.operations[node]
        if name == "constant":
            return literal(detail, self._graph.types[node])
        return self._names[node]

    def _expression(self, node: Node) -> str:
        graph = self._graph
        name, operands, detail = graph.operations[node]
        dtype, before = graph.types[node], graph.types[operands[-1]]
        arguments = [self.value(operand) for operand in operands]
        floating, kind = before.startswith("float"), TYPES[dtype]
        if name == "call":
            return f"{self._source.called(detail, dtype)}({arguments[0]})"
        if name == "select":
            return f"{arguments[0]} ? {arguments[1]} : {arguments[2]}"
        if name == "entry":
            return f"{arguments[0]}[{arguments[1]}]"
        if name == "bits":
            return f"{self._bits(before, dtype)}({arguments[0]})"
        if name == "convert":
            return self._converted(before, dtype, arguments[0])
        if name in _COMPARED:
            return self._comparison(name, operands, arguments, before)
        if name == "fma":
            return f"{self._source.helper(f'fused_{before}', lambda: FUSED[before])}({', '.join(arguments)})"
        if floating and name in _LIBM:
            return f"{_LIBM[name]}{'f' if before == 'float32' else ''}({', '.join(arguments)})"
        if name == "neg":
            return (
                f"-{arguments[0]}"
                if floating
                else f"({kind})({_unsigned(before)}0 - ({_unsigned(before, cast=True)}){arguments[0]})"
            )
        if name in ("shift_left", "shift_right"):
            return f"{self._shift(name, before)}({', '.join(arguments)})"
        if name not in _OPERATORS:
            raise Unsupported(f"{name} of type {before} in C99")
        if floating or before == BOOL or name in ("div", "rem", "and", "or", "xor") or before.startswith("u"):
            expression = f"{arguments[0]} {_OPERATORS[name]} {arguments[1]}"
            return expression if floating else f"({kind})({expression})"
        word = _unsigned(before, cast=True)  # signed numbers must not overflow in C
        return f"({kind})(({word}){arguments[0]} {_OPERATORS[name]} ({word}){arguments[1]})"

    def _comparison(self, name: str, operands: Sequence[Node], arguments: Sequence[str], dtype: str) -> str:
        """A comparison, without those that compilers warn of because their result is known."""
        if operands[0] == operands[1] and dtype.startswith("float") and name not in ("lt", "gt"):
            return f"{'' if name == 'ne' else '!'}isnan({arguments[0]})"
        if operands[0] == operands[1]:
            return f"((void){arguments[0]}, {str(name in ('le', 'ge', 'eq')).lower()})"
        values = [self._graph.value(node) for node in operands]
        if dtype not in (BOOL, "float64", "float32") and any(value is not None for value in values):
            turned = values[0] is not None
            bound, seen = int(values[0] if turned else values[1]), _TURNED.get(name, name) if turned else name
            limits = np.iinfo(dtype)
            constant_results = {("lt", limits.min): "false", ("ge", limits.min): "true", ("gt", limits.max): "false"}
            constant_results[("le", limits.max)] = "true"
            if (seen, bound) in constant_results:
                return f"((void){arguments[turned]}, {constant_results[seen, bound]})"
        return f"{arguments[0]} {_COMPARED[name]} {arguments[1]}"

    def _converted(self, before: str, dtype: str, argument: str) -> str:
        kind = TYPES[dtype]
        if dtype == BOOL:
            return f"{argument} != 0"
        if not before.startswith("float") or dtype.startswith("float"):
            return f"({kind}){argument}"
        low, high = (int(limit) for limit in (np.iinfo(dtype).min, np.iinfo(dtype).max))
        least, beyond = (
            literal(np.dtype(before).type(low), before),
            literal(np.dtype(before).type(2.0 ** high.bit_length()), before),
        )
        ends = literal(np.dtype(dtype).type(low), dtype), literal(np.dtype(dtype).type(high), dtype)
        text = f"""\
static {kind} whole_{before}_{dtype}({TYPES[before]} x) {{
    {kind} y = 0;
    if (x >= {beyond}) {{
        y = {ends[1]};
    }} else if (x >= {least}) {{
        y = ({kind})x;
    }} else if (x < {least}) {{
        y = {ends[0]};
    }} else {{
        y = 0;
    }}
    return y;
}}"""
        return f"{self._source.helper(f'whole_{before}_{dtype}', lambda: text)}({argument})"

    def _bits(self, before: str, dtype: str) -> str:
        name, kind = f"bits_{before}_{dtype}", TYPES[dtype]
        text = f"""\
static {kind} {name}({TYPES[before]} x) {{
    {kind} y;
    (void)memcpy(&y, &x, sizeof y);
    return y;
}}"""
        return self._source.helper(name, lambda: text)

    def _shift(self, name: str, dtype: str) -> str:
        whole, kind, bits = f"{name}_{dtype}", TYPES[dtype], 8 * np.dtype(dtype).itemsize
        word = _unsigned(dtype, cast=True)
        if name == "shift_left":
            within, beyond = f"({kind})(({word})x << n)", "0"
        else:
            within, beyond = "x >> n", f"x >> {bits - 1}" if dtype.startswith("int") else "0"
        text = f"""\
static {kind} {whole}({kind} x, {kind} n) {{
    return ((n >= 0) && (n < {bits})) ? {within} : {beyond};
}}"""
        if not dtype.startswith("int"):
            text = text.replace("(n >= 0) && ", "")
        return self._source.helper(whole, lambda: text)

    def _table(self, node: Node, entries: Sequence[Node]) -> None:
        graph, dtype = self._graph, self._graph.types[node]
        values = [self.value(entry) for entry in entries]
        if all(graph.operations[entry].name == "constant" for entry in entries):
            self._names[node] = self._source.table(dtype, values)
        else:
            self.lines.append(f"const {TYPES[dtype]} v{node}[{len(values)}] = {{{', '.join(values)}}};")
            self._names[node] = f"v{node}"

    def _product(self, node: Node, operands: Sequence[Node], shape: Product) -> None:
        one, other = (self._names[operand] for operand in operands)
        rows, columns, length, kind = shape.rows, shape.columns, shape.length, TYPES[self._graph.types[node]]
        left = f"k * {rows} + i" if shape.turned[0] else f"i * {length} + k"
        right = f"k * {columns} + j" if shape.turned[1] else f"j * {length} + k"
        zero = "0.0f" if kind == "float" else "0.0" if kind == "double" else "0"
        self.lines += [
            f"{kind} v{node}[{rows * columns}];",
            f"for (int32_t i = 0; i < {rows}; ++i) {{",
            f"    for (int32_t j = 0; j < {columns}; ++j) {{",
            f"        {kind} sum = {zero};",
            f"        for (int32_t k = 0; k < {length}; ++k) {{",
            f"            const {kind} term = {one}[{left}] * {other}[{right}];",
            "            sum = (k == 0) ? term : (sum + term);",
            "        }",
            f"        v{node}[i * {columns} + j] = sum;",
            "    }",
            "}",
        ]
        self._names[node] = f"v{node}"

    def _region(self, node: Node, operands: Sequence[Node], number: int) -> None:
        graph, region = self._graph, self._graph.regions[number]
        initial = [self.value(operand) for operand in operands[: len(region.inputs)]]
        names = [f"v{node}r{i}" for i in range(len(region.results))]
        kinds = [TYPES[graph.types[result]] for result in region.results]
        inner = _Body(self._source, graph, self._place, dict(self._names))
        if region.repeats:
            self.lines += [f"{kind} {name} = {value};" for kind, name, value in zip(kinds, names, initial, strict=True)]
            inner._names |= zip(region.inputs, names, strict=True)
            inner.do(graph.needed_inside(number, [region.test]), number)
            inner.lines += [f"if (!({inner.value(region.test)})) {{", "    break;", "}"]
            inner.do(graph.needed_inside(number, region.results), number)
            after = [inner.value(result) for result in region.results]
            inner.lines += [
                f"const {kind} {name}n = {value};" for kind, name, value in zip(kinds, names, after, strict=True)
            ]
            read = set(re.findall(r"\w+", "\n".join(inner.lines)))
            inner.lines += [f"{name} = {name}n;" for name in names]
            # Compilers warn of what is carried from round to round and never read.
            self.lines += ["for (;;) {", *_indented(inner.lines), "}", *(f"(void){n};" for n in names if n not in read)]
        else:
            self.lines += [f"{kind} {name} = 0;" for kind, name in zip(kinds, names, strict=True)]
            inner._names |= zip(region.inputs, initial, strict=True)
            inner.do(graph.needed_inside(number, region.results), number)
            inner.lines += [
                f"{name} = {inner.value(result)};" for name, result in zip(names, region.results, strict=True)
            ]
            self.lines += [f"if ({self.value(region.test)}) {{", *_indented(inner.lines), "}"]
        self._results[node] = names


def literal(value: Any, dtype: str) -> str:
    """A number, exactly."""
    if dtype == BOOL:
        return str(bool(value)).lower()
    if not dtype.startswith("float"):
        suffix = {"int64": "LL", "uint64": "ULL", "int32": "L", "uint32": "UL"}[dtype]
        if int(value) == np.iinfo(dtype).min and dtype.startswith("int"):
            return f"({int(value) + 1}{suffix} - 1)"  # the literal of its absolute value is too large
        return f"({int(value)}{suffix})" if int(value) < 0 else f"{int(value)}{suffix}"
    number = float(value)
    if np.isnan(number):
        return "NAN"
    if np.isinf(number):
        return "INFINITY" if number > 0 else "(-INFINITY)"
    text = f"{number.hex()}{'f' if dtype == 'float32' else ''}"
    return f"({text})" if text.startswith("-") else text


def _unsigned(dtype: str, cast: bool = False) -> str:
    kind = f"uint{8 * np.dtype(dtype).itemsize}_t"
    return kind if cast else f"({kind})"


def _indented(lines: Sequence[str]) -> list[str]:
    return [f"    {line}" for line in lines]
