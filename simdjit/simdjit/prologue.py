"""The prologue of a loop: the numbers of each run, and what is computed from them before the first step."""

import secrets
from collections.abc import Sequence
from typing import Any, NamedTuple

import jax
import numpy as np

from simdjit.fingerprint import fingerprint_of_part
from simdjit.graph import Graph, Nodes, Unsupported, filled
from simdjit.lowering import evaluate, nodes_of
from simdjit.tracing import Traced
from simdjit.xla_program import XlaProgram

# Operations; what needs more of them (a spectrum of random waves) is left to XLA.
_MOST = 15_000


# What is left to XLA, by what it computes: different laws share a disturbance that is sampled before the first step.
_LEFT: dict[str, "_Left"] = {}
_KEPT = 64


class _Left(NamedTuple):
    """A part of a prologue that XLA computes.

    Attributes:
        lacking: why.
        program: from the arguments that it uses to its results.
    """

    lacking: str
    program: XlaProgram


class RunInputs(NamedTuple):
    """What a compiled loop takes of the numbers of its runs.

    Attributes:
        varying: which leaves every run brings along.
        used: which leaves the prologue reads.
        before: what XLA computes of those; None where the program does.
    """

    varying: list[int]
    used: list[int]
    before: XlaProgram | None

    def packed(self, numbers: Any) -> list[np.ndarray]:
        """Arrays of the inputs of a program, with a leading axis over runs, from those of `numbers`."""
        leaves = jax.tree.leaves(numbers)
        computed = self.before.run([leaves[i] for i in self.used]) if self.before else []
        return [*(leaves[i] for i in self.varying), *computed]


class Prologue:
    """What does not depend on the step: computed in the program where there are rules, and by XLA before where not.

    Args:
        prepare: the function, of `numbers`.
        numbers: of one run; a tree of arrays.
        constant: which of its leaves are the same in every run.
        portable: whether the loop will be written for another process.

    Attributes:
        constants: the numbers that are the same in every run.
        inputs: shapes and types of what every lane brings along, in the order of its slots.
    """

    def __init__(self, prepare: Traced, numbers: Any, constant: Sequence[bool], portable: bool = False):
        given = zip(jax.tree.leaves(numbers), prepare.closed.in_avals, strict=True)
        leaves = [np.asarray(leaf, dtype=kind.dtype) for leaf, kind in given]  # as JAX takes them, doubles or not
        self._prepare, self._tree, self._leaves = prepare, jax.tree.structure(numbers), leaves
        self._used = prepare.used() or [0]  # one at least, whose leading axis counts the runs
        self._varying = [i for i, same in enumerate(constant) if not same]
        self._left: _Left | None = None
        self._portable = portable
        # Not its `id`, which another prologue has as soon as this one is gone.
        self._own_name = secrets.token_hex(16)
        self.constants = [leaf if same else None for leaf, same in zip(leaves, constant, strict=True)]
        self.inputs = [leaves[i] for i in self._varying]

    @property
    def lacking(self) -> str:
        """Why XLA computes it; empty where the program does."""
        return self._left.lacking if self._left else ""

    def leave_to_xla(self, lacking: str) -> None:
        """Compute it by XLA, because the program cannot.

        Raises:
            Unsupported: XLA cannot do it for many runs at once either.
        """
        made = [place is None for place in self._prepare.passed_on()]
        name, only = self._name(), self._prepare.only(made)

        def function(used: list[Any]) -> list[Any]:
            leaves = list(self._leaves)
            for i, leaf in zip(self._used, used, strict=True):
                leaves[i] = leaf
            return only(jax.tree.unflatten(self._tree, leaves))

        left = _LEFT.get(name)
        if left is None:
            try:
                left = _Left(lacking, XlaProgram(function, [self._leaves[i] for i in self._used], self._portable))
            except Exception as error:  # whatever JAX raises for what it cannot do for several at once
                raise Unsupported(f"{lacking}; nor can JAX compute it for several runs ({error})") from error
            if len(_LEFT) >= _KEPT:
                _LEFT.clear()
            _LEFT[name] = left
        self._left = left
        self.inputs += [leaf for leaf, new in zip(self._prepare.leaves, made, strict=True) if new]

    def lowered(self) -> tuple[Graph, list[Nodes]]:
        """A graph with what is computed in the program, and the nodes of the results.

        Raises:
            Unsupported: neither the program nor XLA can do it for many runs at once.
        """
        known = _LEFT.get(self._name())
        if known and not self._left:  # the same has been tried before
            self.leave_to_xla(known.lacking)
        if not self._left:
            try:
                graph, given = self._given()
                return graph, evaluate(graph, self._prepare.closed, given, _MOST)
            except Unsupported as lacking:
                self.leave_to_xla(str(lacking))
        graph, given = self._given()
        further = iter(given[len(self._leaves) :])
        return graph, [next(further) if place is None else given[place] for place in self._prepare.passed_on()]

    def of_runs(self) -> RunInputs:
        """What the program takes of the numbers of its runs."""
        return RunInputs(self._varying, self._used, self._left.program if self._left else None)

    def _name(self) -> str:
        """Of what is computed before the first step; of this prologue alone where that has no name."""
        made = [i for i, place in enumerate(self._prepare.passed_on()) if place is None]
        constants = [self.constants[i] for i in self._used]
        name = fingerprint_of_part(self._prepare.closed, self._used, made, constants) or self._own_name
        return f"{name}, portable" if self._portable else name

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
