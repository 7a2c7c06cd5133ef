"""A program of lanes: made from functions of one run, run for any number of them."""

from collections.abc import Callable
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np

from simdjit import nvidia
from simdjit.assembly import TICK, Sections, assembly, operations
from simdjit.beginning import Beginning, inputs
from simdjit.cuda import Driver
from simdjit.errors import Unsupported
from simdjit.graph import I64
from simdjit.machine import Code, lanes_of
from simdjit.memory import Layout
from simdjit.nodes import flat
from simdjit.scalarise import evaluate
from simdjit.tracing import Traced

# Operations; machine code of a longer program would take minutes to make.
_MOST = 200_000


class Program:
    """Start, steps and looks, compiled for vector registers or for a GPU.

    Args:
        draw: numbers -> all that is known from then on.
        start: known -> carry.
        step: known, carry, number of the step -> carry.
        look: known, carry, number of the step -> what is to be kept of an instant.
        numbers: of one run; a tree of arrays.
        constant: which leaves of `numbers` are the same in every run; they make the program short.
        lanes: runs at once; as many as fit a register unless given. No result depends on it.
        driver: of the GPU that is to run it; None for this processor. No result depends on it.

    Raises:
        Unsupported: a function needs something that lanes cannot do.
        OSError: the GPU's driver fails.
    """

    def __init__(
        self,
        draw: Callable,
        start: Callable,
        step: Callable,
        look: Callable,
        numbers: Any,
        constant: list[bool],
        lanes: int = 0,
        driver: Driver | None = None,
    ):
        drawn = Traced(draw, numbers)
        self._beginning = Beginning(drawn, numbers, constant)
        graph, known = self._beginning.graph, self._beginning.nodes
        of_arrays = lambda function: lambda arrays, *rest: function(eqx.combine(arrays, drawn.still), *rest)
        begun = Traced(of_arrays(start), drawn.shapes)
        first = evaluate(graph, begun.closed, known, _MOST)

        number = jax.ShapeDtypeStruct((), jnp.asarray(0).dtype)
        k = graph.input(TICK, I64)
        k = k if number.dtype == I64 else graph.apply("convert", k, dtype=str(number.dtype))
        given = [*known, *inputs(graph, "carry", begun.leaves), np.array(k)]
        carried = lambda function: lambda known, carry, k: function(known, eqx.combine(carry, begun.still), k)
        self._tick, self._look = (
            Traced(of_arrays(carried(function)), drawn.shapes, begun.shapes, number) for function in (step, look)
        )
        if self._tick.types != begun.types:
            raise Unsupported("a carry that changes its type")
        ticked, looked = (evaluate(graph, traced.closed, given, _MOST) for traced in (self._tick, self._look))

        sections = Sections(*map(flat, (first, ticked, looked)))
        self.operations = operations(graph, sections)
        if driver is None:
            lanes = lanes or lanes_of(8 * np.dtype(number.dtype).itemsize)
            self._code = Code(assembly(graph, sections, lanes))
        else:
            lanes = nvidia.LANES
            self._code = nvidia.Kernel(assembly(graph, sections, lanes, nvidia.THREADS), driver)
        several = (self._beginning.inputs, begun.leaves, self._look.leaves)
        self._numbers_layout, self._carry_layout, self._look_layout = (Layout(leaves, lanes) for leaves in several)

    def run(self, numbers: Any, steps: int, every: int = 0) -> tuple[Any, Any]:
        """Run it.

        Args:
            numbers: as in the example, with a leading axis over runs.
            steps: how many.
            every: steps between looks, the first before the first step; 0 for none.

        Returns:
            The carry after the last step, and what was looked at with an axis over looks; both with a leading axis
            over runs.
        """
        runs = len(jax.tree.leaves(numbers)[0])
        given = self._numbers_layout.packed(self._beginning.packed(numbers), runs)
        carry = self._carry_layout.memory(len(given))
        series = self._look_layout.memory(len(given), steps // every + 1 if every else 0)
        self._code.run(given, carry, series, steps, every)
        final = [leaf[:, 0] for leaf in self._carry_layout.unpacked(carry, runs)]
        return self._tick.whole(final), self._look.whole(self._look_layout.unpacked(series, runs))
