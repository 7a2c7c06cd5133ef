"""JAX's primitives that make one entry of many: sums, products of matrices, extremes; in order, one after another."""

from collections.abc import Callable, Sequence
from functools import partial, reduce
from itertools import accumulate
from typing import Any

import numpy as np

from undertow.lanes import elementwise
from undertow.lanes.errors import Unsupported
from undertow.lanes.graph import Graph, Node
from undertow.lanes.nodes import Nodes, filled

Rule = Callable[[Graph, list[Nodes], dict[str, Any], Any], Nodes]


def _reduction(name: str, nothing: float) -> Rule:
    """Entries along some axes; `nothing` is what none of them give."""

    def rule(graph: Graph, given: list[Nodes], params: dict[str, Any], out: Any) -> Nodes:
        axes = params["axes"]
        kept = [axis for axis in range(given[0].ndim) if axis not in axes]
        count = int(np.prod([given[0].shape[axis] for axis in axes]))
        if not count:
            return np.full(out.shape, graph.constant(nothing, str(out.dtype)))
        rows = given[0].transpose([*kept, *axes]).reshape(-1, count).tolist()
        return filled(out.shape, [reduce(elementwise.on(graph, name), row) for row in rows])

    return rule


def _running(name: str) -> Rule:
    def rule(graph: Graph, given: list[Nodes], params: dict[str, Any], out: Any) -> Nodes:
        lines = np.moveaxis(given[0], params["axis"], -1)
        way = slice(None, None, -1) if params["reverse"] else slice(None)
        rows = lines[..., way].reshape(-1, lines.shape[-1]).tolist()
        found = filled(lines.shape, [node for row in rows for node in accumulate(row, elementwise.on(graph, name))])
        return np.moveaxis(found[..., way], -1, params["axis"])

    return rule


def _place(name: str) -> Rule:
    """Where the extreme is; the first of several."""

    def rule(graph: Graph, given: list[Nodes], params: dict[str, Any], out: Any) -> Nodes:
        (axis,) = params["axes"]
        lines = np.moveaxis(given[0], axis, -1)
        constants = [graph.constant(i, str(out.dtype)) for i in range(lines.shape[-1])]
        places = []
        for row in lines.reshape(-1, lines.shape[-1]).tolist():
            best, place = row[0], constants[0]
            for node, here in zip(row[1:], constants[1:], strict=True):
                better = graph.apply(name, node, best)
                best, place = graph.apply("select", better, node, best), graph.apply("select", better, here, place)
            places.append(place)
        return filled(out.shape, places)

    return rule


def _dot(graph: Graph, given: list[Nodes], params: dict[str, Any], out: Any) -> Nodes:
    (left_axes, right_axes), (left_batch, right_batch) = params["dimension_numbers"]

    def rows(nodes: Nodes, axes: Sequence[int], batch: Sequence[int]) -> list[list[list[Node]]]:
        free = [axis for axis in range(nodes.ndim) if axis not in (*axes, *batch)]
        size = [int(np.prod([nodes.shape[axis] for axis in some])) for some in (batch, free, axes)]
        return nodes.transpose([*batch, *free, *axes]).reshape(size).tolist()

    left, right = rows(given[0], left_axes, left_batch), rows(given[1], right_axes, right_batch)
    add, times = (partial(graph.apply, name) for name in ("add", "mul"))
    sums = [
        reduce(add, [times(a, b) for a, b in zip(one, other, strict=True)])
        for ones, others in zip(left, right, strict=True)
        for one in ones
        for other in others
    ]
    return filled(out.shape, sums)


def _iota(graph: Graph, given: list[Nodes], params: dict[str, Any], out: Any) -> Nodes:
    axis = params["dimension"]
    line = [graph.constant(i, str(out.dtype)) for i in range(out.shape[axis])]
    shape = [-1 if other == axis else 1 for other in range(len(out.shape))]
    return np.broadcast_to(np.array(line, dtype=np.int64).reshape(shape), out.shape)


def _pad(graph: Graph, given: list[Nodes], params: dict[str, Any], out: Any) -> Nodes:
    array, value = given
    padding = params["padding_config"]
    if any(low < 0 or high < 0 or within for low, high, within in padding):
        raise Unsupported("a pad that cuts or spreads")
    whole = np.full(out.shape, int(value), dtype=np.int64)
    places = zip(padding, array.shape, strict=True)
    whole[tuple(slice(low, low + size) for (low, _, _), size in places)] = array
    return whole


RULES: dict[str, Rule] = {
    "dot_general": _dot,
    "iota": _iota,
    "pad": _pad,
    "reduce_sum": _reduction("add", 0),
    "reduce_prod": _reduction("mul", 1),
    "reduce_max": _reduction("max", -np.inf),
    "reduce_min": _reduction("min", np.inf),
    "reduce_and": _reduction("and", True),
    "reduce_or": _reduction("or", False),
    "cumsum": _running("add"),
    "cumprod": _running("mul"),
    "cummax": _running("max"),
    "cummin": _running("min"),
    "argmax": _place("gt"),
    "argmin": _place("lt"),
}
