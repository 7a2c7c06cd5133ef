"""What a program begins with: the numbers of a run, and what is drawn from them."""

from collections.abc import Callable
from typing import Any

import jax
import numpy as np

from simdjit.batches import batched
from simdjit.errors import Unsupported
from simdjit.graph import Graph
from simdjit.nodes import Nodes, filled
from simdjit.scalarise import evaluate, nodes_of
from simdjit.tracing import Traced

# Operations; to draw what needs more of them (a spectrum of waves) is left to XLA.
_MOST = 15_000


class Beginning:
    """What does not depend on the step: drawn in lanes where that can be, and by XLA before where not.

    Args:
        draw: the function, of `numbers`.
        numbers: of one run; a tree of arrays.
        constant: which of its leaves are the same in every run.

    Attributes:
        graph: with what is drawn in lanes.
        nodes: of its results.
        inputs: shapes and types of what every lane brings along, in the order of its slots.

    Raises:
        Unsupported: neither lanes nor XLA can do it for many runs at once.
    """

    def __init__(self, draw: Traced, numbers: Any, constant: list[bool]):
        given = zip(jax.tree.leaves(numbers), draw.closed.in_avals, strict=True)
        leaves = [np.asarray(leaf, dtype=kind.dtype) for leaf, kind in given]  # as JAX takes them, doubles or not
        self._varying = [i for i, same in enumerate(constant) if not same]
        self._before: Callable[[Any], list[np.ndarray]] | None = None
        self.inputs = [leaves[i] for i in self._varying]
        try:
            self.graph, given = self._given(leaves)
            self.nodes = evaluate(self.graph, draw.closed, given, _MOST)
        except Unsupported as lacking:
            passed_on = draw.passed_on()
            made = [place is None for place in passed_on]
            self.inputs += [leaf for leaf, new in zip(draw.leaves, made, strict=True) if new]
            try:
                self._before = batched(draw.only(made), numbers)
            except Exception as error:  # whatever JAX raises for what it cannot do for several at once
                raise Unsupported(f"{lacking}; nor can JAX draw it for several runs ({error})") from error
            self.graph, given = self._given(leaves)
            further = iter(given[len(leaves) :])
            self.nodes = [next(further) if place is None else given[place] for place in passed_on]

    def packed(self, numbers: Any) -> list[np.ndarray]:
        """Arrays of `inputs`, with a leading axis over runs, from those of `numbers`."""
        leaves = jax.tree.leaves(numbers)
        before = self._before(numbers) if self._before else []
        return [*(leaves[i] for i in self._varying), *before]

    def _given(self, leaves: list[Any]) -> tuple[Graph, list[Nodes]]:
        """A new graph, and nodes of all numbers and then of what is made before."""
        graph = Graph()
        made = inputs(graph, "number", self.inputs)
        nodes = [np.zeros(0, dtype=np.int64)] * len(leaves)
        for i, leaf in enumerate(leaves):
            if i not in self._varying:
                nodes[i] = nodes_of(graph, leaf)
        for i, several in zip(self._varying, made, strict=False):
            nodes[i] = several
        return graph, nodes + made[len(self._varying) :]


def inputs(graph: Graph, kind: str, leaves: list[Any]) -> list[Nodes]:
    """Nodes of arrays that lie in memory, slot after slot."""
    several, slot = [], 0
    for leaf in leaves:
        size = int(np.prod(leaf.shape))
        nodes = [graph.input((kind, slot + i), str(leaf.dtype)) for i in range(size)]
        several.append(filled(leaf.shape, nodes))
        slot += size
    return several
