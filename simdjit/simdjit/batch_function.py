"""A function of one run, compiled for batches."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import jax

from simdjit.cuda import Driver
from simdjit.loop import Loop


def compile(
    function: Callable[..., Any], *example: Any, lanes: int = 0, driver: Driver | None = None, cache: Path | None = None
) -> Callable[..., Any]:
    """A function of one run, compiled for batches.

    Args:
        function: of trees of arrays; anything that JAX can trace.
        example: its arguments for one run; shapes and types count.
        lanes: runs in one vector; as many as fit a register unless given. No result depends on it.
        driver: of the GPU that computes it, as `gpu` finds it; None for this processor.
        cache: folder of compiled code; None for SIMDJIT_CACHE or the default.

    Returns:
        The function of the same trees with a leading axis over runs on every array, giving arrays of NumPy.

    Raises:
        Unsupported: the function needs something that the compiler has no rule for.
        OSError: the GPU's driver fails.
    """
    loop = Loop.recording(function, example, lanes=lanes, driver=driver, cache=cache)

    def run(*arguments: Any) -> Any:
        _, recorded = loop.run(arguments, steps=0, every=1)
        return jax.tree.map(lambda leaf: leaf[:, 0], recorded)

    return run
