"""Sorting few numbers: a network of comparisons, the same for all lanes (K. E. Batcher, 1968)."""

from collections.abc import Iterator, Sequence

import numpy as np

from simdjit import elementwise
from simdjit.graph import I64, Graph, Node, Nodes, Unsupported
from simdjit.rules import Equation, rule
from simdjit.scalar import Scalar, where

# Numbers; a network for more of them would be long.
_MOST = 64


@rule("sort", reads="dimension num_keys", idle="is_stable")
def _sort(equation: Equation, *operands: Nodes) -> list[Nodes]:
    """By the first operands, the others along with them; equal ones stay in their order."""
    graph, axis = equation.graph, equation.params["dimension"]
    lines = [np.moveaxis(nodes, axis, -1) for nodes in operands]
    shape = lines[0].shape
    if shape[-1] > _MOST:
        raise Unsupported(f"sorting of {shape[-1]} numbers, more than {_MOST}")
    rows = [nodes.reshape(-1, shape[-1]).tolist() for nodes in lines]
    sorted_ = [_sorted(graph, row, equation.params["num_keys"]) for row in zip(*rows, strict=True)]
    return [
        np.moveaxis(np.array([row[i] for row in sorted_], dtype=np.int64).reshape(shape), -1, axis)
        for i in range(len(operands))
    ]


def _sorted(graph: Graph, rows: Sequence[list[Node]], keys: int) -> list[list[Node]]:
    places = [graph.constant(i, I64) for i in range(len(rows[0]))]
    # What is compared: keys, and then where a row stood; what is moved: that, and everything.
    ordered = [[_key(Scalar(graph, node)).node for node in row] for row in rows[:keys]]
    columns = [list(column) for column in zip(*ordered, places, *rows, strict=True)]
    for low, high in _network(len(columns)):
        low_column, high_column = columns[low], columns[high]
        first = _before(graph, high_column[: keys + 1], low_column[: keys + 1])
        pairs = list(zip(low_column, high_column, strict=True))
        columns[low] = [graph.apply("select", first, b, a) for a, b in pairs]
        columns[high] = [graph.apply("select", first, a, b) for a, b in pairs]
    return [list(row) for row in zip(*columns, strict=True)][keys + 1 :]


def _key(x: Scalar) -> Scalar:
    """All zeros alike, and all that is no number, which comes last."""
    if not x.type.startswith("float"):
        return x
    x = where(x.equal(0.0), 0.0, x)
    return where(x.equal(x), x, float("nan"))


def _before(graph: Graph, row: Sequence[Node], other_row: Sequence[Node]) -> Node:
    """Whether one row comes before another."""
    less = elementwise.on(graph, "lt_to")
    before = less(row[-1], other_row[-1])
    for a, b in reversed(list(zip(row[:-1], other_row[:-1], strict=True))):
        before = graph.apply("or", less(a, b), graph.apply("and", _same(graph, a, b), before))
    return before


def _same(graph: Graph, a: Node, b: Node) -> Node:
    less = elementwise.on(graph, "le_to")
    return graph.apply("and", less(a, b), less(b, a))


def _network(size: int) -> Iterator[tuple[int, int]]:
    """Pairs to be put in order, one after another, for any number of rows."""
    step = 1
    while step < size:
        apart = step
        while apart:
            for first in range(apart % step, size - apart, 2 * apart):
                for low in range(first, min(first + apart, size - apart)):
                    if low // (2 * step) == (low + apart) // (2 * step):
                        yield low, low + apart
            apart //= 2
        step *= 2
