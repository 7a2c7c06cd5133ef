"""One compiled step that keeps its numbers and its state: by the batch compiler where it can, otherwise by XLA."""

from collections.abc import Callable
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np

from undertow.core.batch_compiler import Unsupported
from undertow.core.errors import BadInput
from undertow.simulation.loop.closed_loop import ClosedLoop, Realization
from undertow.simulation.loop.simd_batch import kept_step, realized_disturbance


class Uncopied:
    """An object with compiled steps, whose arrays are those of its programs: a copy of it would go on with old numbers.

    Copying and pickling raise BadInput.
    """

    _instead = "Make another one"

    def __copy__(self):
        raise BadInput(type(self).__name__, "not be copied", hint=self._instead)

    def __deepcopy__(self, memo: Any):
        self.__copy__()

    def __reduce__(self):
        self.__copy__()


class CompiledStep(Uncopied):
    """A function (numbers, state, inputs) -> (state, outputs), compiled for one run.

    Write into the arrays of `inputs`, call, and read those of `outputs`. Two threads may not call the same step.

    Args:
        function: of three trees of arrays; its state has the types of the one that it gets.
        numbers: what does not change from call to call.
        state: before the first call.
        inputs: examples of what changes.

    Attributes:
        backend: `simd` or `xla`, as in scenarios.
        numbers, state, inputs, outputs: trees of NumPy arrays, to be written into or read.
    """

    def __init__(self, function: Callable, numbers: Any, state: Any, inputs: Any):
        try:
            self._step: Any = kept_step(function, numbers, state, inputs)
            self.backend = "simd"
        except Unsupported:
            self._step = _ByXla(function, numbers, state, inputs)
            self.backend = "xla"
        self.numbers, self.state, self.inputs = self._step.numbers, self._step.state, self._step.inputs
        self.outputs = self._step.outputs

    def __call__(self) -> None:
        """Take the step: the outputs and the new state follow from the inputs, the numbers and the old state."""
        self._step()


def compile_step(function: Callable, part: Any, state: Any, inputs: Any) -> CompiledStep:
    """A compiled step whose numbers are those of a part: function(part, state, inputs) -> (state, outputs)."""
    of_part, static = eqx.partition(part, eqx.is_array)
    return CompiledStep(
        lambda of_part, state, inputs: function(eqx.combine(of_part, static), state, inputs), of_part, state, inputs
    )


class _ByXla:
    """The same by XLA, in arrays that are copied to and fro; a call takes a tenth of a millisecond or more."""

    def __init__(self, function: Callable, numbers: Any, state: Any, inputs: Any):
        copied = lambda tree: jax.tree.map(lambda leaf: np.array(leaf), tree)
        self.numbers, self.state, self.inputs = copied(numbers), copied(state), copied(inputs)
        self._function = jax.jit(function).lower(self.numbers, self.state, self.inputs).compile()
        _, outputs = self._function(self.numbers, self.state, self.inputs)
        self.outputs = copied(outputs)

    def __call__(self) -> None:
        results = self._function(self.numbers, self.state, self.inputs)
        for target, value in zip(jax.tree.leaves((self.state, self.outputs)), jax.tree.leaves(results), strict=True):
            target[...] = value


def realized(loop: ClosedLoop, key: Any) -> Realization:
    """A closed loop with everything random as a simulation samples it: bit for bit where the batch compiler can."""
    try:
        disturbance = jax.tree.map(jnp.asarray, realized_disturbance(loop, key))
    except Unsupported:
        return loop.realize(key)
    return loop.realized_with(disturbance, key)


def copy_into(targets: Any, values: Any) -> None:
    """Write the arrays of a tree into those of another."""
    for target, value in zip(jax.tree.leaves(targets), jax.tree.leaves(values), strict=True):
        if target is not value:
            target[...] = value
