"""The prologue of a loop: the numbers of each run, and what is computed from them before the first step."""

from collections.abc import Callable, Sequence
from typing import Any

import jax
import numpy as np

from simdjit.graph import Graph, Nodes, Unsupported, filled
from simdjit.lowering import evaluate, nodes_of
from simdjit.tracing import Traced

# Operations; what needs more of them (a spectrum of waves) is left to XLA.
_MOST = 15_000


# The width of a program decides about the last bits of a result, what is in the other places does not: every program
# has this width, however few runs there are, so that no result depends on how they are cut into tasks.
_WIDTH = 64


def _by_vmap(function: Callable[[Any], Any], numbers: Any) -> Callable[[Any], Any]:
    """The function with a leading axis over runs, by `jax.vmap`: for what has no rule.

    Args:
        function: of a tree of arrays.
        numbers: an example of that.
    """
    width = _WIDTH
    stacked = jax.tree.map(lambda leaf: jax.ShapeDtypeStruct((width, *np.shape(leaf)), leaf.dtype), numbers)
    program = jax.jit(jax.vmap(function)).lower(stacked).compile()

    def run(numbers: Any) -> Any:
        runs, pieces = len(jax.tree.leaves(numbers)[0]), []
        for first in range(0, runs, width):
            which = np.minimum(np.arange(first, first + width), runs - 1)
            results = program(jax.tree.map(lambda leaf, which=which: np.asarray(leaf)[which], numbers))
            pieces.append(jax.tree.map(np.asarray, results))
        return jax.tree.map(lambda *parts: np.concatenate(parts)[:runs], *pieces)

    return run


class Prologue:
    """What does not depend on the step: computed in the program where there are rules, and by XLA before where not.

    Args:
        prepare: the function, of `numbers`.
        numbers: of one run; a tree of arrays.
        constant: which of its leaves are the same in every run.

    Attributes:
        lacking: why XLA computes it; empty where the program does.
        constants: the numbers that are the same in every run.
        inputs: shapes and types of what every lane brings along, in the order of its slots.
    """

    def __init__(self, prepare: Traced, numbers: Any, constant: Sequence[bool]):
        given = zip(jax.tree.leaves(numbers), prepare.closed.in_avals, strict=True)
        leaves = [np.asarray(leaf, dtype=kind.dtype) for leaf, kind in given]  # as JAX takes them, doubles or not
        self._prepare, self._numbers, self._leaves = prepare, numbers, leaves
        self._varying = [i for i, same in enumerate(constant) if not same]
        self._before: Callable[[Any], list[np.ndarray]] | None = None
        self.lacking = ""
        self.constants = [leaf if same else None for leaf, same in zip(leaves, constant, strict=True)]
        self.inputs = [leaves[i] for i in self._varying]

    def leave_to_xla(self, lacking: str) -> None:
        """Compute it by XLA, because the program cannot.

        Raises:
            Unsupported: XLA cannot do it for many runs at once either.
        """
        made = [place is None for place in self._prepare.passed_on()]
        try:
            self._before = _by_vmap(self._prepare.only(made), self._numbers)
        except Exception as error:  # whatever JAX raises for what it cannot do for several at once
            raise Unsupported(f"{lacking}; nor can JAX compute it for several runs ({error})") from error
        self.inputs += [leaf for leaf, new in zip(self._prepare.leaves, made, strict=True) if new]
        self.lacking = lacking

    def lowered(self) -> tuple[Graph, list[Nodes]]:
        """A graph with what is computed in the program, and the nodes of the results.

        Raises:
            Unsupported: neither the program nor XLA can do it for many runs at once.
        """
        if not self.lacking:
            try:
                graph, given = self._given()
                return graph, evaluate(graph, self._prepare.closed, given, _MOST)
            except Unsupported as lacking:
                self.leave_to_xla(str(lacking))
        graph, given = self._given()
        further = iter(given[len(self._leaves) :])
        return graph, [next(further) if place is None else given[place] for place in self._prepare.passed_on()]

    def packed(self, numbers: Any) -> list[np.ndarray]:
        """Arrays of `inputs`, with a leading axis over runs, from those of `numbers`."""
        leaves = jax.tree.leaves(numbers)
        before = self._before(numbers) if self._before else []
        return [*(leaves[i] for i in self._varying), *before]

    def _given(self) -> tuple[Graph, list[Nodes]]:
        """A new graph, and nodes of all numbers and then of what is made before."""
        graph = Graph()
        made = inputs(graph, "number", self.inputs)
        nodes = [np.zeros(0, dtype=np.int64)] * len(self._leaves)
        for i, leaf in enumerate(self.constants):
            if leaf is not None:
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
