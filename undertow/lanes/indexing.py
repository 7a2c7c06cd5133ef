"""JAX's primitives that take or set entries at places only the lanes know: choices among all places there are."""

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from undertow.lanes.errors import Unsupported
from undertow.lanes.graph import Graph, Node
from undertow.lanes.nodes import Nodes, filled

# More places than these would be too many instructions.
_PLACES = 128


def _choice(graph: Graph, which: Node, one: Nodes, other: Nodes) -> Nodes:
    pairs = zip(one.ravel().tolist(), np.broadcast_to(other, one.shape).ravel().tolist(), strict=True)
    return filled(one.shape, [graph.apply("select", which, a, b) for a, b in pairs])


def _known(graph: Graph, start: Node, last: int) -> int | None:
    """A start that all lanes share, moved inside."""
    value = graph.value(start)
    if value is None and last > _PLACES:
        raise Unsupported(f"a place out of {last + 1}")
    return None if value is None else int(np.clip(value, 0, last))


def window(graph: Graph, array: Nodes, starts: Sequence[Node], sizes: Sequence[int]) -> Nodes:
    """Part of an array; where it would stick out it is moved inside."""
    for axis, (start, size) in enumerate(zip(starts, sizes, strict=True)):
        last = array.shape[axis] - size
        cut = lambda first, array=array, axis=axis, size=size: array.take(range(first, first + size), axis)
        known = _known(graph, start, last)
        found = cut(known or 0)
        if known is None:
            for first in range(1, last + 1):
                found = _choice(graph, graph.apply("ge", start, graph.like(first, start)), cut(first), found)
        array = found
    return array


def replaced(graph: Graph, array: Nodes, starts: Sequence[Node], part: Nodes, inside: bool) -> Nodes:
    """An array with a part put in.

    Args:
        inside: whether a part that would stick out is moved inside, or left out.
    """
    lasts = [whole - size for whole, size in zip(array.shape, part.shape, strict=True)]
    open_ends = [last + 1 for start, last in zip(starts, lasts, strict=True) if graph.value(start) is None]
    if np.prod(open_ends) > _PLACES:
        raise Unsupported("a part put at one of many places")
    options = []
    for start, last in zip(starts, lasts, strict=True):
        value = graph.value(start)
        if value is None:
            options.append(range(last + 1))
        else:
            options.append([int(np.clip(value, 0, last))] if inside or 0 <= value <= last else [])
    found = array
    for place in np.ndindex(*map(len, options)):
        firsts = [option[i] for option, i in zip(options, place, strict=True)]
        put = array.copy()
        put[tuple(slice(first, first + size) for first, size in zip(firsts, part.shape, strict=True))] = part
        here = graph.constant(True, "bool")
        for start, first, last in zip(starts, firsts, lasts, strict=True):
            if graph.value(start) is None:
                here = graph.apply("and", here, _at(graph, start, first, last, inside))
        found = _choice(graph, here, put, found)
    return found


def _at(graph: Graph, start: Node, first: int, last: int, inside: bool) -> Node:
    """Whether a start is at a place, or beyond it at the edge."""
    name = "eq" if not inside or 0 < first < last else "le" if first == 0 else "ge"
    return graph.constant(True, "bool") if inside and last == 0 else graph.apply(name, start, graph.like(first, start))


def _dynamic_slice(graph: Graph, given: list[Nodes], params: dict[str, Any], out: Any) -> Nodes:
    starts = [int(start) for start in given[1:]]
    return window(graph, given[0], starts, params["slice_sizes"])


def _dynamic_update_slice(graph: Graph, given: list[Nodes], params: dict[str, Any], out: Any) -> Nodes:
    return replaced(graph, given[0], [int(start) for start in given[2:]], given[1], inside=True)


def _gather(graph: Graph, given: list[Nodes], params: dict[str, Any], out: Any) -> Nodes:
    array, indices = given
    numbers, sizes = params["dimension_numbers"], params["slice_sizes"]
    if numbers.operand_batching_dims:
        raise Unsupported("gather in batches")
    drop = "FILL_OR_DROP" in str(params["mode"])
    rows = []
    for index in indices.reshape(-1, indices.shape[-1]).tolist():
        starts = _starts(graph, array, numbers.start_index_map, index)
        part = window(graph, array, starts, sizes)
        if drop:
            fill = np.full(part.shape, graph.constant(_fill(params, out.dtype), str(out.dtype)))
            lasts = [whole - size for whole, size in zip(array.shape, sizes, strict=True)]
            part = _choice(graph, _within(graph, starts, lasts), part, fill)
        rows.append(part.reshape([size for axis, size in enumerate(sizes) if axis not in numbers.collapsed_slice_dims]))
    batch = indices.shape[:-1]
    stacked = np.stack(rows).reshape((*batch, *rows[0].shape))
    return np.moveaxis(stacked, range(len(batch), stacked.ndim), numbers.offset_dims)


def _fill(params: dict[str, Any], dtype: np.dtype) -> Any:
    """What stands where nothing is; as JAX chooses it."""
    if params["fill_value"] is not None:
        return params["fill_value"]
    if dtype.kind == "f":
        return np.nan
    return True if dtype.kind == "b" else np.iinfo(dtype).min if dtype.kind == "i" else np.iinfo(dtype).max


def _starts(graph: Graph, array: Nodes, axes: Sequence[int], index: list[Node]) -> list[Node]:
    starts = [graph.constant(0, "int64")] * array.ndim
    for axis, start in zip(axes, index, strict=True):
        starts[axis] = start
    return starts


def _within(graph: Graph, starts: list[Node], lasts: list[int]) -> Node:
    inside = graph.constant(True, "bool")
    for start, last in zip(starts, lasts, strict=True):
        for name, bound in (("ge", 0), ("le", last)):
            inside = graph.apply("and", inside, graph.apply(name, start, graph.like(bound, start)))
    return inside


def _scatter(graph: Graph, given: list[Nodes], params: dict[str, Any], out: Any) -> Nodes:
    array, indices, updates = given
    numbers = params["dimension_numbers"]
    if numbers.operand_batching_dims:
        raise Unsupported("scatter in batches")
    batch = indices.shape[:-1]
    windows = np.moveaxis(updates, numbers.update_window_dims, range(len(batch), updates.ndim))
    shape = list(windows.shape[len(batch) :])
    for axis in sorted(numbers.inserted_window_dims):
        shape.insert(axis, 1)
    inside = "CLIP" in str(params["mode"])
    for index, part in zip(indices.reshape(-1, indices.shape[-1]).tolist(), windows.reshape(-1, *shape), strict=True):
        starts = _starts(graph, array, numbers.scatter_dims_to_operand_dims, index)
        array = replaced(graph, array, starts, part, inside)
    return array


RULES: dict[str, Callable[[Graph, list[Nodes], dict[str, Any], Any], Nodes]] = {
    "dynamic_slice": _dynamic_slice,
    "dynamic_update_slice": _dynamic_update_slice,
    "gather": _gather,
    "scatter": _scatter,
}
