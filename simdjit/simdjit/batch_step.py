"""One step of many runs, called by somebody else's clock: their memory is kept, so that nothing is packed anew."""

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import jax
import numpy as np

from simdjit.graph import Unsupported
from simdjit.loop import Loop
from simdjit.tracing import same_types


class BatchStep:
    """A compiled function (numbers, state, inputs) -> (state, outputs) of many runs that keeps numbers and states.

    It has the bits that `Step` and `Loop` have, whatever the other runs are. Two threads may not call the same one.

    Args:
        function: of three trees of arrays of one run; its state has the types of the one that it gets.
        numbers: of one run, what does not change from call to call.
        state: of one run.
        inputs: of one run.
        runs: how many.
        constant: which leaves of `numbers` are the same in every run; None for none.
        cache: folder of compiled code; None for SIMDJIT_CACHE or the default.

    Raises:
        Unsupported: the function needs something that the compiler has no rule for, or changes the types of its state.
    """

    def __init__(
        self,
        function: Callable,
        numbers: Any,
        state: Any,
        inputs: Any,
        runs: int,
        constant: Sequence[bool] | None = None,
        cache: Path | None = None,
    ):
        example = (numbers, state, inputs)
        sizes = [len(jax.tree.leaves(part)) for part in example]
        same = [*(constant or [False] * sizes[0]), *[False] * (sizes[1] + sizes[2])]
        loop = Loop.recording(function, example, same, cache=cache)
        after, outputs = jax.eval_shape(function, *example)
        if not same_types(state, after):
            raise Unsupported("a state that changes its type")
        self._call, taken, recorded = loop.kept_runs(runs)
        self._lanes = taken[0].shape[1]
        varying = [leaf for leaf, fixed in zip(jax.tree.leaves(example), same, strict=True) if not fixed]
        for array, value in zip(taken, varying, strict=True):
            array[...] = value
        first = len(taken) - sizes[1] - sizes[2]
        self._places = {"numbers": taken[:first], "state": taken[first : first + sizes[1]]}
        self._places["inputs"] = taken[first + sizes[1] :]
        self._after, self._found = recorded[: sizes[1]], recorded[sizes[1] :]
        self._form, self._all = jax.tree.structure(outputs), np.arange(runs)

    def put(self, what: str, values: Any, runs: np.ndarray | None = None) -> None:
        """Write `numbers` (those that are not constant), `state` or `inputs`.

        Args:
            what: one of these words.
            values: arrays, in the order of the tree, with a leading axis over the runs that are written.
            runs: their numbers; None for all.
        """
        at = divmod(self._all if runs is None else runs, self._lanes)
        for array, value in zip(self._places[what], jax.tree.leaves(values), strict=True):
            array[at] = value

    def __call__(self) -> Any:
        """Take a step of every run; returns the outputs, with a leading axis over runs."""
        self._call()
        for array, value in zip(self._places["state"], self._after, strict=True):
            array[...] = value
        at = divmod(self._all, self._lanes)
        return jax.tree.unflatten(self._form, [array[at] for array in self._found])
