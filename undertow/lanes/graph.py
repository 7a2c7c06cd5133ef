"""Arithmetic on scalars as a graph: every operation once, and none whose result is known."""

from typing import Any

import numpy as np

from undertow.lanes.simplify import COMPARISONS, RESULTS, simpler

# An entry of a graph, its position. Arrays of them stand for arrays of scalars: NumPy does all that only moves them.
Node = int

BOOL, F64, I64, U64, U32 = "bool", "float64", "int64", "uint64", "uint32"

_EITHER_WAY = ("add", "mul", "and", "or", "xor", "eq", "ne")


class Graph:
    """Operations in an order in which they can be done.

    Attributes:
        operations: ("constant", number), ("input", name) or the name of an operation and the nodes it works on.
        types: NumPy's name of the type of each node.
    """

    def __init__(self) -> None:
        self.operations: list[tuple] = []
        self.types: list[str] = []
        self._known: dict[Any, Node] = {}

    def constant(self, value: Any, dtype: str) -> Node:
        """A number that is the same in every lane."""
        number = np.asarray(value).astype(dtype)[()]
        return self._node(("constant", number), dtype, (number.tobytes(), dtype))

    def like(self, value: Any, node: Node) -> Node:
        """A constant of the type of another node."""
        return self.constant(value, self.types[node])

    def input(self, name: Any, dtype: str) -> Node:
        """A number that every lane brings along."""
        return self._node(("input", name), dtype, ("input", name))

    def value(self, node: Node) -> Any:
        """The number of a constant, None for what may differ between lanes."""
        name, *rest = self.operations[node]
        return rest[0] if name == "constant" else None

    def apply(self, name: str, *nodes: Node, dtype: str = "") -> Node:
        """Result of an operation.

        Args:
            name: one of `simplify.RESULTS`.
            nodes: operands.
            dtype: type of the result where the operation changes it.
        """
        dtype = dtype or (BOOL if name in COMPARISONS else self.types[nodes[-1]])
        values = [self.value(node) for node in nodes]
        if all(value is not None for value in values):
            with np.errstate(all="ignore"):
                return self.constant(RESULTS[name](*values, dtype), dtype)
        if name in _EITHER_WAY:
            nodes = tuple(sorted(nodes))
            values = [self.value(node) for node in nodes]
        same = simpler(self, name, nodes, values)
        return self._node((name, *nodes), dtype, (name, *nodes, dtype)) if same is None else same

    def needed(self, wanted: Any) -> list[bool]:
        """Which nodes the wanted ones are made from, themselves included."""
        needed = [False] * len(self.operations)
        for node in map(int, wanted):
            needed[node] = True
        for node in reversed(range(len(needed))):
            if needed[node] and self.operations[node][0] not in ("constant", "input"):
                for operand in self.operations[node][1:]:
                    needed[operand] = True
        return needed

    def _node(self, operation: tuple, dtype: str, key: Any) -> Node:
        if key not in self._known:
            self._known[key] = len(self.operations)
            self.operations.append(operation)
            self.types.append(dtype)
        return self._known[key]
