"""JAX's primitives that make one entry of many: sums, products of matrices, extremes; in order, one after another."""

from collections.abc import Sequence
from functools import partial, reduce
from itertools import accumulate

import numpy as np

from simdjit import elementwise
from simdjit.graph import BOOL, Graph, Node, Nodes, Unsupported, filled
from simdjit.matrix_loop import FROM, product
from simdjit.rules import Equation, rule
from simdjit.scalar import Scalar, where


def _nothing(name: str, dtype: str) -> float | bool:
    """What an operation makes of no entries."""
    if name in ("add", "or", "xor"):
        return 0
    if name in ("mul", "and"):
        return 1 if name == "mul" or dtype == BOOL else -1
    if dtype == BOOL:
        return name == "min"
    limits = (-np.inf, np.inf) if dtype.startswith("float") else (np.iinfo(dtype).min, np.iinfo(dtype).max)
    return limits[name == "min"]


def _reduction(primitive: str, name: str) -> None:
    """Entries along some axes."""

    @rule(primitive, reads="axes")
    def reduction(equation: Equation, operand: Nodes) -> Nodes:
        axes = equation.params["axes"]
        remaining_axes = [axis for axis in range(operand.ndim) if axis not in axes]
        count = int(np.prod([operand.shape[axis] for axis in axes]))
        if not count:
            return np.full(equation.shape, equation.constant(_nothing(name, str(equation.out.dtype))))
        rows = operand.transpose([*remaining_axes, *axes]).reshape(-1, count).tolist()
        return filled(equation.shape, [reduce(elementwise.on(equation.graph, name), row) for row in rows])


def _running(primitive: str, name: str) -> None:
    @rule(primitive, reads="axis reverse")
    def running(equation: Equation, operand: Nodes) -> Nodes:
        axis = equation.params["axis"]
        lines = np.moveaxis(operand, axis, -1)
        way = slice(None, None, -1) if equation.params["reverse"] else slice(None)
        rows = lines[..., way].reshape(-1, lines.shape[-1]).tolist()
        add = elementwise.on(equation.graph, name)
        sums = filled(lines.shape, [node for row in rows for node in accumulate(row, add)])
        return np.moveaxis(sums[..., way], -1, axis)


def _place(primitive: str, name: str) -> None:
    """Where the extreme is; the first of several, and the first that is no number if there is one."""

    @rule(primitive, reads="axes index_dtype")
    def place(equation: Equation, operand: Nodes) -> Nodes:
        (axis,) = equation.params["axes"]
        lines = np.moveaxis(operand, axis, -1)
        places = [Scalar(equation.graph, equation.constant(i)) for i in range(lines.shape[-1])]
        rows = ([Scalar(equation.graph, node) for node in row] for row in lines.reshape(-1, lines.shape[-1]).tolist())
        return filled(equation.shape, [_first(name, row, places).node for row in rows])


def _first(name: str, row: Sequence[Scalar], places: Sequence[Scalar]) -> Scalar:
    best, best_place = row[0], places[0]
    for entry, entry_place in zip(row[1:], places[1:], strict=True):
        better = entry.apply(name, best)
        if entry.type.startswith("float"):
            better = better | (entry.apply("ne", entry) & best.equal(best))
        best, best_place = where(better, entry, best), where(better, entry_place, best_place)
    return best_place


@rule("dot_general", reads="dimension_numbers preferred_element_type", idle="precision")
def _dot(equation: Equation, left_operand: Nodes, right_operand: Nodes) -> Nodes:
    graph, dtype = equation.graph, str(equation.out.dtype)
    if dtype == BOOL:
        raise Unsupported("a product of matrices of truths")
    (left_axes, right_axes), (left_batch, right_batch) = equation.params["dimension_numbers"]

    def rows(nodes: Nodes, axes: Sequence[int], batch: Sequence[int]) -> list[list[list[Node]]]:
        free = [axis for axis in range(nodes.ndim) if axis not in (*axes, *batch)]
        size = [int(np.prod([nodes.shape[axis] for axis in some])) for some in (batch, free, axes)]
        return _converted(graph, nodes, dtype).transpose([*batch, *free, *axes]).reshape(size).tolist()

    left, right = rows(left_operand, left_axes, left_batch), rows(right_operand, right_axes, right_batch)
    add, times = (partial(graph.apply, name) for name in ("add", "mul"))
    useful = lambda a, b: graph.value(a) != 0 and graph.value(b) != 0
    ones, others = left[0], right[0]
    if sum(useful(a, b) for row in ones for column in others for a, b in zip(row, column, strict=True)) >= FROM:
        pairs = zip(left, right, strict=True)
        return filled(equation.shape, [node for several, many in pairs for node in product(graph, several, many)])
    sums = [
        reduce(add, [times(a, b) for a, b in zip(ones, others, strict=True)] or [equation.constant(0)])
        for several, many in zip(left, right, strict=True)
        for ones in several
        for others in many
    ]
    return filled(equation.shape, sums)


def _converted(graph: Graph, nodes: Nodes, dtype: str) -> Nodes:
    return filled(nodes.shape, [Scalar(graph, node).to("convert", dtype).node for node in nodes.ravel().tolist()])


@rule("iota", reads="dimension shape dtype")
def _iota(equation: Equation) -> Nodes:
    axis, shape = equation.params["dimension"], equation.shape
    line = [equation.constant(i) for i in range(shape[axis])]
    across = [-1 if other == axis else 1 for other in range(len(shape))]
    return np.broadcast_to(np.array(line, dtype=np.int64).reshape(across), shape)


@rule("pad", reads="padding_config")
def _pad(equation: Equation, operand: Nodes, value: Nodes) -> Nodes:
    """Entries may be spread, and cut off where the padding is negative."""
    for axis, (low, high, within) in enumerate(equation.params["padding_config"]):
        lines = np.moveaxis(operand, axis, 0)
        size = max(len(lines) + within * (len(lines) - 1), 0)
        padded = np.full((max(low, 0) + size + max(high, 0), *lines.shape[1:]), int(value), dtype=np.int64)
        padded[max(low, 0) :][: size : within + 1] = lines
        cut = padded[max(-low, 0) : len(padded) - max(-high, 0)]
        operand = np.moveaxis(cut, 0, axis)
    return operand


for _primitive, _name in (
    ("sum", "add"),
    ("prod", "mul"),
    ("max", "max"),
    ("min", "min"),
    ("and", "and"),
    ("or", "or"),
    ("xor", "xor"),
):
    _reduction(f"reduce_{_primitive}", _name)
for _primitive, _name in (("cumsum", "add"), ("cumprod", "mul"), ("cummax", "max"), ("cummin", "min")):
    _running(_primitive, _name)
_place("argmax", "gt")
_place("argmin", "lt")
