"""One step of one run, called by somebody else's clock: its memory is kept, so that a call costs microseconds."""

import pickle
from collections.abc import Callable
from pathlib import Path
from typing import Any

import jax

from simdjit.graph import Unsupported
from simdjit.loop import Loop
from simdjit.tracing import same_types


class Step:
    """A compiled function (numbers, state, inputs) -> (state, outputs) that keeps numbers and state between calls.

    Write into the arrays of `inputs`, call, and read those of `outputs`. It has the bits that `Loop` has. Two threads
    may not call the same step.

    Args:
        function: of three trees of arrays; its state has the types of the one that it gets.
        numbers: what does not change from call to call.
        state: before the first call.
        inputs: examples of what changes.
        cache: folder of compiled code; None for SIMDJIT_CACHE or the default.
        portable: whether it will be `written`.

    Attributes:
        numbers, state, inputs, outputs: trees of NumPy arrays in the memory of the program. Truths are whole numbers.

    Raises:
        Unsupported: the function needs something that the compiler has no rule for, or changes the types of its state.
    """

    def __init__(
        self,
        function: Callable,
        numbers: Any,
        state: Any,
        inputs: Any,
        cache: Path | None = None,
        portable: bool = False,
    ):
        example = (numbers, state, inputs)
        loop = Loop.recording(function, example, lanes=1, cache=cache, portable=portable)
        results = jax.eval_shape(function, *example)
        if not same_types(state, results[0]):
            raise Unsupported("a state that changes its type")
        self._keep(loop, jax.tree.structure(results), example)

    def _keep(self, loop: Loop, form: Any, example: tuple[Any, Any, Any]) -> None:
        self._loop, self._form = loop, form
        self._call, arguments, recorded, read, written = loop.kept()
        self.numbers, self.state, self.inputs = jax.tree.unflatten(jax.tree.structure(example), arguments)
        after, self.outputs = jax.tree.unflatten(form, recorded)
        # The numbers of the state stand together, before and after: they are copied at once.
        size = lambda tree: sum(leaf.size for leaf in jax.tree.leaves(tree))
        first, count = size(self.numbers), size(after)
        self._before, self._after = read[first : first + count], written[:count]
        for array, value in zip(arguments, jax.tree.leaves(example), strict=True):
            array[...] = value

    def written(self) -> bytes:
        """For a file: what `Step.read` makes the step of, in another process and without its function.

        Raises:
            Unsupported: its outputs hold something that cannot be written.
        """
        try:
            return pickle.dumps((self._loop.written(), self._form))
        except Exception as error:  # whatever pickle says
            raise Unsupported(f"a step that cannot be written ({error})") from error

    @classmethod
    def read(cls, written: bytes, numbers: Any, state: Any, inputs: Any, cache: Path | None = None) -> "Step":
        """The step that was `written`, with numbers, state and inputs of the same structure."""
        loop, form = pickle.loads(written)
        step = cls.__new__(cls)
        step._keep(Loop.read(loop, cache), form, (numbers, state, inputs))
        return step

    def __call__(self) -> None:
        """Take the step: the outputs and the new state follow from the inputs, the numbers and the old state."""
        self._call()
        self._before[...] = self._after
