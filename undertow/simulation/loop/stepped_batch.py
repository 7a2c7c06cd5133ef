"""Many runs at once, each started and stepped from outside: by the batch compiler where it can, otherwise by XLA."""

from collections.abc import Callable, Sequence
from typing import Any

import equinox as eqx
import jax
import numpy as np

from undertow.core.batch_compiler import Unsupported
from undertow.simulation.loop.simd_batch import kept_steps, starter


class Starter:
    """The start of runs: everything random, and what follows from it.

    Args:
        prepare: numbers -> what does not change in a run, such as a `Realization`.
        begin: prepared -> results of the start; arrays.
        numbers: of one run.
        constant: which of its arrays are equal in all runs.

    Attributes:
        backend: `simd` or `xla`.
    """

    def __init__(self, prepare: Callable, begin: Callable, numbers: Any, constant: Sequence[bool]):
        try:
            self._begin = starter(prepare, begin, numbers, constant)
            self.backend = "simd"
        except Unsupported:
            by_xla = jax.jit(jax.vmap(lambda numbers: begin(prepare(numbers))))
            self._begin = lambda numbers: jax.tree.map(np.asarray, by_xla(numbers))
            self.backend = "xla"

    def __call__(self, numbers: Any) -> Any:
        """Results for numbers with a leading axis over runs, with such an axis."""
        return self._begin(numbers)


class CompiledBatchStep:
    """A function (numbers, state, inputs) -> (state, outputs) of many runs, which keeps numbers and states.

    Args:
        function: of three trees of arrays of one run; its state has the types of the one that it gets.
        numbers: of one run, what does not change from call to call.
        state: of one run.
        inputs: of one run.
        runs: how many.
        constant: which arrays of `numbers` are equal in all runs, and never written.

    Attributes:
        backend: `simd` or `xla`.
    """

    def __init__(self, function: Callable, numbers: Any, state: Any, inputs: Any, runs: int, constant: Sequence[bool]):
        try:
            self._step: Any = kept_steps(function, numbers, state, inputs, runs, constant)
            self.backend = "simd"
        except Unsupported:
            self._step = _ByXla(function, numbers, state, inputs, runs, constant)
            self.backend = "xla"

    def put(self, what: str, values: Any, runs: np.ndarray | None = None) -> None:
        """Write `numbers` (those that are not constant), `state` or `inputs`.

        Args:
            what: one of these words.
            values: arrays in the order of the tree, with a leading axis over the runs that are written.
            runs: their numbers; None for all.
        """
        self._step.put(what, values, runs)

    def __call__(self) -> Any:
        """Take a step of every run; returns the outputs, with a leading axis over runs."""
        return self._step()


class _ByXla:
    """The same as one program of XLA."""

    def __init__(self, function: Callable, numbers: Any, state: Any, inputs: Any, runs: int, constant: Sequence[bool]):
        leaves, form = jax.tree.flatten(numbers)
        varying = [None if same else leaf for leaf, same in zip(leaves, constant, strict=True)]
        fixed = jax.tree.unflatten(form, [leaf if same else None for leaf, same in zip(leaves, constant, strict=True)])
        stacked = lambda tree: jax.tree.map(lambda leaf: np.broadcast_to(leaf, (runs, *np.shape(leaf))).copy(), tree)
        varying_arguments = jax.tree.unflatten(form, varying), state, inputs
        self._given = {
            name: stacked(part) for name, part in zip(("numbers", "state", "inputs"), varying_arguments, strict=True)
        }
        run_step = lambda run_numbers, state, inputs: function(eqx.combine(run_numbers, fixed), state, inputs)
        self._step = jax.jit(jax.vmap(run_step)).lower(*self._given.values()).compile()

    def put(self, what: str, values: Any, runs: np.ndarray | None = None) -> None:
        targets = jax.tree.leaves(self._given[what])
        for target, value in zip(targets, jax.tree.leaves(values), strict=True):
            target[slice(None) if runs is None else runs] = value

    def __call__(self) -> Any:
        state, outputs = self._step(*self._given.values())
        self.put("state", state)
        return jax.tree.map(np.array, outputs)  # which the caller may write into
