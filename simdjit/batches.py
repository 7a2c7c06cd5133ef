"""A function of one run for any number of them, by `jax.vmap`: for what has no rule in lanes."""

from collections.abc import Callable
from typing import Any

import jax
import numpy as np

# The width of a program decides about the last bits of a result, who is in the other places does not: every program
# has this width, however few runs there are, so that no result depends on how they are cut into tasks.
_WIDTH = 64


def batched(function: Callable[[Any], Any], numbers: Any, width: int = 0) -> Callable[[Any], Any]:
    """The function with a leading axis over runs, on arrays and with arrays of NumPy.

    Args:
        function: of a tree of arrays.
        numbers: an example of that.
        width: runs of a program; the usual unless given.
    """
    width = width or _WIDTH
    stacked = jax.tree.map(lambda leaf: jax.ShapeDtypeStruct((width, *np.shape(leaf)), leaf.dtype), numbers)
    program = jax.jit(jax.vmap(function)).lower(stacked).compile()

    def run(numbers: Any) -> Any:
        runs, pieces = len(jax.tree.leaves(numbers)[0]), []
        for first in range(0, runs, width):
            which = np.minimum(np.arange(first, first + width), runs - 1)
            results = program(jax.tree.map(lambda leaf, which=which: leaf[which], numbers))
            pieces.append(jax.tree.map(np.asarray, results))
        return jax.tree.map(lambda *parts: np.concatenate(parts)[:runs], *pieces)

    return run
