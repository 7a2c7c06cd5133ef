"""Arithmetic on scalars as a graph: every operation once, and none whose result is known."""

from collections.abc import Iterable, Sequence
from typing import Any, NamedTuple

import numpy as np

from simdjit.simplify import COMPARISONS, RESULTS, simpler


class Unsupported(Exception):
    """A function uses something that the compiler has no rule for; says what."""


# An entry of a graph, its position. Arrays of them stand for arrays of scalars: NumPy does all that only moves them.
Node = int

# Arrays of nodes, one for each scalar of an array.
Nodes = np.ndarray

BOOL, F64, F32, I64, U64, U32 = "bool", "float64", "float32", "int64", "uint64", "uint32"

# What numbers can be.
TYPES = (BOOL, F64, F32, I64, "int32", U64, U32)

# Operations whose two operands may change places.
COMMUTATIVE = frozenset(("add", "mul", "and", "or", "xor", "eq", "ne"))


class Operation(NamedTuple):
    """What a node is.

    Attributes:
        name: one of `simplify.RESULTS`, or constant, input, region, result, table, entry, call.
        operands: nodes that it works on; an entry's are a table and a place in it.
        detail: number of a constant, name of an input, number of a region, place of a result among a region's, name
            of what is called.
    """

    name: str
    operands: tuple[Node, ...] = ()
    detail: Any = None


class Region(NamedTuple):
    """Operations that are done several times or not at all; see `regions`.

    Attributes:
        repeats: done for as long as the test holds in any lane, rather than once if it does.
        inputs: stand for the first operands of the region's node, and when it repeats for its results so far.
        test: in which lanes it is done.
        results: what it gives.
    """

    repeats: bool
    inputs: tuple[Node, ...]
    test: Node
    results: tuple[Node, ...]


class Graph:
    """Operations in an order in which they can be done.

    Attributes:
        operations: one per node.
        types: NumPy's name of the type of each node.
        homes: number of the innermost region that a node depends on; None outside of all.
        regions: by number.
        parents: the region around each region, None where there is none.
        open: the region that is being made.
        active: the lanes that need what is being made; None for all.
        endless: loops so far whose end only the lanes know.
        memory: what was made before, for those who make more than one operation at once.
    """

    def __init__(self) -> None:
        self.operations: list[Operation] = []
        self.types: list[str] = []
        self.homes: list[int | None] = []
        self.regions: dict[int, Region] = {}
        self.parents: list[int | None] = []
        self.open: int | None = None
        self.active: Node | None = None
        self.endless = 0
        self.memory: dict[Any, Node] = {}
        self._known: dict[Any, Node] = {}
        self._applied: dict[tuple[str, tuple[Node, ...], str], Node] = {}  # what has been asked for
        self._values: list[Any] = []  # numbers of the constants
        self._plain: dict[Any, Node] = {}  # constants by Python's numbers

    def constant(self, value: Any, dtype: str) -> Node:
        """A number that is the same in every lane."""
        plain = (value, dtype) if type(value) in (int, float) and value != 0 else None  # zeros have a sign
        if plain in self._plain:
            return self._plain[plain]
        number = np.asarray(value).astype(_supported(dtype))[()]
        node = self.node(Operation("constant", detail=number), dtype, key=(number.tobytes(), dtype))
        if plain:
            self._plain[plain] = node
        return node

    def like(self, value: Any, node: Node) -> Node:
        """A constant of the type of another node."""
        return self.constant(value, self.types[node])

    def input(self, name: Any, dtype: str, home: int | None = None) -> Node:
        """A number that comes from elsewhere: from memory, or into a region."""
        return self.node(Operation("input", detail=name), _supported(dtype), home)

    def value(self, node: Node) -> Any:
        """The number of a constant, None for what may differ between lanes."""
        return self._values[node]

    def apply(self, name: str, *nodes: Node, dtype: str = "") -> Node:
        """Result of an operation.

        Args:
            name: one of `simplify.RESULTS`.
            nodes: operands.
            dtype: type of the result where the operation changes it.
        """
        if name in COMMUTATIVE and nodes[0] > nodes[1]:
            nodes = nodes[::-1]
        asked = (name, nodes, dtype)
        result = self._applied.get(asked)
        if result is None:
            result = self._applied[asked] = self._result(name, nodes, dtype)
        return result

    def _result(self, name: str, nodes: tuple[Node, ...], dtype: str) -> Node:
        types, numbers = self.types, self._values
        kind = types[nodes[-1]]
        for node in nodes[name == "select" :]:
            assert types[node] == kind, (name, dtype)
        dtype = dtype or (BOOL if name in COMPARISONS else kind)
        values = [numbers[node] for node in nodes]
        for value in values:
            if value is None:
                break
        else:
            with np.errstate(all="ignore"):
                return self.constant(RESULTS[name](*values, dtype), dtype)
        same = simpler(self, name, nodes, values)
        return self.node(Operation(name, nodes), dtype) if same is None else same

    def entry(self, table: Sequence[Node], index: Node) -> Node:
        """The entry of a table at a place within it, a number of type int64; the table lies in memory."""
        constant_index = self.value(index)
        if constant_index is not None:
            return table[int(constant_index)]
        held = self.node(Operation("table", tuple(table)), self.types[table[0]])
        return self.node(Operation("entry", (held, index)), self.types[held])

    def node(self, operation: Operation, dtype: str, home: int | None = None, key: Any = None) -> Node:
        """The node of an operation, the same for the same one."""
        key = (operation, dtype) if key is None else key
        number = self._known.get(key)
        if number is None:
            number = self._known[key] = len(self.operations)
            self.operations.append(operation)
            self.types.append(dtype)
            self._values.append(operation.detail if operation.name == "constant" else None)
            inner = self.innermost(*operation.operands)
            self.homes.append(inner if home is None else max(home, inner, key=self._depth))
        return number

    def innermost(self, *nodes: Node) -> int | None:
        """The home of what is made of some nodes."""
        homes, innermost = self.homes, None
        for node in nodes:
            home = homes[node]
            if home is not None and home != innermost:
                innermost = home if innermost is None else max(home, innermost, key=self._depth)
        return innermost

    def around(self, region: int) -> int:
        """The outermost region around a region."""
        parent = self.parents[region]
        return region if parent is None else self.around(parent)

    def inside(self, node: Node, region: int) -> bool:
        """Whether a node depends on what happens in a region."""
        home = self.homes[node]
        while home is not None and home != region:
            home = self.parents[home]
        return home == region

    def needed(self, results: Iterable[Node]) -> list[bool]:
        """Which nodes the wanted ones are made from, themselves included."""
        needed = [False] * len(self.operations)
        for node in results:
            needed[node] = True
        for node in reversed(range(len(needed))):
            if needed[node]:
                for operand in self.uses(node):
                    needed[operand] = True
        return needed

    def needed_inside(self, region: int, results: Iterable[Node]) -> list[Node]:
        """The nodes of a region that the wanted ones are made from, in order; with no look at the rest of the graph."""
        inside_nodes, stack = set(), list(results)
        while stack:
            node = stack.pop()
            if node not in inside_nodes and self.inside(node, region):
                inside_nodes.add(node)
                stack += self.uses(node)
        return sorted(inside_nodes)

    def uses(self, node: Node) -> tuple[Node, ...]:
        """What a node is made from, and what a region does inside."""
        name, operands, detail = self.operations[node]
        if name != "region":
            return operands
        region = self.regions[detail]
        return (*operands, region.test, *region.results)

    def _depth(self, home: int | None) -> int:
        return 0 if home is None else 1 + self._depth(self.parents[home])


def filled(shape: Sequence[int], nodes: Sequence[Node]) -> Nodes:
    """An array of nodes in their order."""
    return np.array(nodes, dtype=np.int64).reshape(shape)


def flat(arrays: Sequence[Nodes]) -> list[Node]:
    """All nodes of some arrays, one after another."""
    return [node for nodes in arrays for node in nodes.ravel().tolist()]


def _supported(dtype: str) -> str:
    """A type of numbers.

    Raises:
        Unsupported: lanes have none such.
    """
    if dtype not in TYPES:
        raise Unsupported(f"numbers of type {dtype}")
    return dtype
