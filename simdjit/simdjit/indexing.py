"""JAX's primitives that take or set entries at places only the lanes know.

Few places are chosen among, one after another; of many the entries lie in memory, where they can be taken but not set.
"""

from collections.abc import Callable, Sequence
from itertools import product

import numpy as np

from simdjit import elementwise
from simdjit.graph import BOOL, I64, Graph, Node, Nodes, Unsupported, filled
from simdjit.rules import Equation, rule

# Places that are chosen among; more of them are quicker taken from memory.
_FEW = 24

# Choices for which entries are set; more of them would be too many instructions.
_CHOICES = 2_000


def _choice(graph: Graph, which: Node, chosen: Nodes, otherwise: Nodes) -> Nodes:
    pairs = zip(chosen.ravel().tolist(), np.broadcast_to(otherwise, chosen.shape).ravel().tolist(), strict=True)
    return filled(chosen.shape, [graph.apply("select", which, a, b) for a, b in pairs])


def window(graph: Graph, array: Nodes, starts: Sequence[Node], sizes: Sequence[int]) -> Nodes:
    """Part of an array; where it would stick out it is moved inside."""
    if not int(np.prod(sizes)):
        return np.zeros(sizes, dtype=np.int64)
    lasts = [length - size for length, size in zip(array.shape, sizes, strict=True)]
    open_axes = [axis for axis, start in enumerate(starts) if graph.value(start) is None and lasts[axis]]
    for axis, (start, size, last) in enumerate(zip(starts, sizes, lasts, strict=True)):
        if axis not in open_axes:
            value = graph.value(start)
            first = 0 if value is None else min(max(int(value), 0), last)
            array = array.take(range(first, first + size), axis)
    if int(np.prod([lasts[axis] + 1 for axis in open_axes])) > _FEW:
        return _from_memory(graph, array, [(axis, starts[axis], lasts[axis]) for axis in open_axes], sizes)
    for axis in open_axes:
        cut = lambda first, array=array, axis=axis: array.take(range(first, first + sizes[axis]), axis)
        selected = cut(0)
        for first in range(1, lasts[axis] + 1):
            start = starts[axis]
            selected = _choice(graph, graph.apply("ge", start, graph.like(first, start)), cut(first), selected)
        array = selected
    return array


def _from_memory(graph: Graph, array: Nodes, starts: Sequence[tuple[int, Node, int]], sizes: Sequence[int]) -> Nodes:
    """A window of an array that lies in memory; its axis, start and last start of each that the lanes know."""
    strides = [int(np.prod(array.shape[axis + 1 :])) for axis in range(array.ndim)]
    place = graph.constant(0, I64)
    for axis, start, last in starts:
        start_index = graph.apply("convert", start, dtype=I64) if graph.types[start] != I64 else start
        inside = elementwise.on(graph, "clamp")(graph.constant(0, I64), start_index, graph.constant(last, I64))
        place = graph.apply("add", place, graph.apply("mul", inside, graph.constant(strides[axis], I64)))
    table, entries = array.ravel().tolist(), []
    truths = graph.types[table[0]] == BOOL
    if truths:  # memory holds numbers
        table = [graph.apply("convert", node, dtype=I64) for node in table]
    for offsets in product(*map(range, sizes)):
        beyond = sum(offset * stride for offset, stride in zip(offsets, strides, strict=True))
        entries.append(graph.entry(table, graph.apply("add", place, graph.constant(beyond, I64))))
    if truths:
        entries = [graph.apply("ne", node, graph.constant(0, I64)) for node in entries]
    return filled(sizes, entries)


def replaced(
    graph: Graph, array: Nodes, starts: Sequence[Node], part: Nodes, inside: bool, merged: Callable[[Node, Node], Node]
) -> Nodes:
    """An array with a part put in.

    Args:
        graph: gets the operations.
        array: whose entries stay as they are elsewhere.
        starts: of the part, along every axis.
        part: what is put in.
        inside: whether a part that would stick out is moved inside, or left out.
        merged: of what stands there and what is put in, what stands there afterwards.
    """
    lasts = [length - size for length, size in zip(array.shape, part.shape, strict=True)]
    options = []
    for start, last in zip(starts, lasts, strict=True):
        value = graph.value(start)
        if value is None:
            options.append(range(last + 1))
        else:
            options.append([min(max(int(value), 0), last)] if inside or 0 <= value <= last else [])
    if int(np.prod([len(option) for option in options])) * part.size > _CHOICES and not all(
        len(option) == 1 for option in options
    ):
        raise Unsupported(f"{part.size} entries set at one of {np.prod([len(option) for option in options])} places")
    result = array.copy()
    for firsts in product(*options):
        hit = graph.constant(True, BOOL)
        for start, first, last in zip(starts, firsts, lasts, strict=True):
            if graph.value(start) is None:
                hit = graph.apply("and", hit, _at(graph, start, first, last, inside))
        places = tuple(slice(first, first + size) for first, size in zip(firsts, part.shape, strict=True))
        pairs = zip(array[places].ravel().tolist(), part.ravel().tolist(), strict=True)
        put = filled(part.shape, [merged(old, new) for old, new in pairs])
        result[places] = _choice(graph, hit, put, result[places])
    return result


def _at(graph: Graph, start: Node, first: int, last: int, inside: bool) -> Node:
    """Whether a start is at a place, or beyond it at the edge."""
    name = "eq" if not inside or 0 < first < last else "le" if first == 0 else "ge"
    return graph.constant(True, BOOL) if inside and last == 0 else graph.apply(name, start, graph.like(first, start))


@rule("dynamic_slice", reads="slice_sizes")
def _dynamic_slice(equation: Equation, array: Nodes, *starts: Nodes) -> Nodes:
    return window(equation.graph, array, list(map(int, starts)), equation.params["slice_sizes"])


@rule("dynamic_update_slice")
def _dynamic_update_slice(equation: Equation, array: Nodes, part: Nodes, *starts: Nodes) -> Nodes:
    return replaced(equation.graph, array, list(map(int, starts)), part, True, lambda old, new: new)


@rule("gather", reads="dimension_numbers slice_sizes mode fill_value", idle="unique_indices indices_are_sorted")
def _gather(equation: Equation, array: Nodes, indices: Nodes) -> Nodes:
    graph, params = equation.graph, equation.params
    numbers, sizes = params["dimension_numbers"], params["slice_sizes"]
    left_out = (*numbers.collapsed_slice_dims, *numbers.operand_batching_dims)
    drop = _drops(params["mode"])
    batch, rows = indices.shape[:-1], []
    for batch_index in np.ndindex(batch):
        starts = _starts(graph, array, numbers.start_index_map, indices[batch_index].tolist())
        for axis, along in zip(numbers.operand_batching_dims, numbers.start_indices_batching_dims, strict=True):
            starts[axis] = graph.constant(batch_index[along], I64)
        part = window(graph, array, starts, sizes)
        if drop:
            fill = np.full(part.shape, equation.constant(_fill(params["fill_value"], equation.out.dtype)))
            lasts = [length - size for length, size in zip(array.shape, sizes, strict=True)]
            part = _choice(graph, _within(graph, starts, lasts), part, fill)
        rows.append(part.reshape([size for axis, size in enumerate(sizes) if axis not in left_out]))
    if not rows:
        return np.zeros(equation.shape, dtype=np.int64)
    stacked = np.stack(rows).reshape((*batch, *rows[0].shape))
    return np.moveaxis(stacked, range(len(batch), stacked.ndim), numbers.offset_dims)


def _drops(mode: object) -> bool:
    """Whether what lies outside is left out, rather than moved inside."""
    name = str(mode)
    if not any(known in name for known in ("FILL_OR_DROP", "CLIP", "PROMISE_IN_BOUNDS")):
        raise Unsupported(f"places outside taken as {mode}")
    return "FILL_OR_DROP" in name


def _fill(value: float | None, dtype: np.dtype) -> float | bool:
    """What stands where nothing is; as JAX chooses it."""
    if value is not None:
        return value
    if dtype.kind == "f":
        return np.nan
    return True if dtype.kind == "b" else np.iinfo(dtype).min if dtype.kind == "i" else np.iinfo(dtype).max


def _starts(graph: Graph, array: Nodes, axes: Sequence[int], index: list[Node]) -> list[Node]:
    starts = [graph.constant(0, I64)] * array.ndim
    for axis, start in zip(axes, index, strict=True):
        starts[axis] = start
    return starts


def _within(graph: Graph, starts: list[Node], lasts: list[int]) -> Node:
    inside = graph.constant(True, BOOL)
    for start, last in zip(starts, lasts, strict=True):
        for name, bound in (("ge", 0), ("le", last)):
            inside = graph.apply("and", inside, graph.apply(name, start, graph.like(bound, start)))
    return inside


def _scatter(primitive: str, merging: str | None) -> None:
    """Entries set, or merged with what stands there; one after another where a place occurs twice."""

    @rule(
        primitive, reads="dimension_numbers mode", idle="update_jaxpr update_consts indices_are_sorted unique_indices"
    )
    def scatter(equation: Equation, array: Nodes, indices: Nodes, updates: Nodes) -> Nodes:
        graph = equation.graph
        merged = elementwise.on(graph, merging) if merging else lambda old, new: new
        numbers = equation.params["dimension_numbers"]
        inside = not _drops(equation.params["mode"])
        batch = indices.shape[:-1]
        windows = np.moveaxis(updates, numbers.update_window_dims, range(len(batch), updates.ndim))
        shape = list(windows.shape[len(batch) :])
        for axis in sorted((*numbers.inserted_window_dims, *numbers.operand_batching_dims)):
            shape.insert(axis, 1)
        for batch_index in np.ndindex(batch):
            starts = _starts(graph, array, numbers.scatter_dims_to_operand_dims, indices[batch_index].tolist())
            for axis, along in zip(numbers.operand_batching_dims, numbers.scatter_indices_batching_dims, strict=True):
                starts[axis] = graph.constant(batch_index[along], I64)
            array = replaced(graph, array, starts, windows[batch_index].reshape(shape), inside, merged)
        return array


_scatter("scatter", None)
for _primitive, _merging in (("add", "add"), ("sub", "sub"), ("mul", "mul"), ("min", "min"), ("max", "max")):
    _scatter(f"scatter-{_primitive}", _merging)
