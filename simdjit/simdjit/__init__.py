"""simdjit compiles JAX functions of one run for batches of runs, with one run in every lane of a vector register.

    import jax.numpy as jnp, numpy as np, simdjit
    f = simdjit.compile(lambda x: jnp.sin(x) * x, np.zeros(()))
    f(np.linspace(0.0, 1.0, 1000))

`compile` is for a function, `Loop` for a loop over steps, `Step` and `BatchStep` for one step at a time, of one run
or of many. They take examples of the numbers of one run, and the first two run on this processor or on an NVIDIA GPU.
A result has the same bits on every processor, in every lane, and whatever the other runs of the batch are: sums and
products are never contracted, and elementary functions are made of them and of explicit fused products. What the
compiler has no rule for raises `Unsupported`; `jax.vmap` still does it.

How it works: a traced function becomes a graph of scalar operations (`lowering`, `graph`, `simplify`), that becomes
LLVM's assembly in which every scalar is a vector over lanes (`codegen`, `instructions`), and LLVM makes machine code of
it, for this processor (`cpu`) or for a GPU where every lane is a thread (`nvidia`, `cuda`). `c99` writes it as C.
"""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import jax
import numpy as np

from simdjit import c99 as c99
from simdjit.batch_step import BatchStep as BatchStep
from simdjit.cache import cached as cached
from simdjit.cache import default_folder as default_folder
from simdjit.cpu import simd_width as simd_width
from simdjit.cuda import Driver as Driver
from simdjit.graph import Unsupported as Unsupported
from simdjit.loop import Loop as Loop
from simdjit.nvidia import gpu as gpu
from simdjit.portable import PortableProgram as PortableProgram
from simdjit.step import Step as Step


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
    nothing = np.zeros(())
    loop = Loop(
        lambda arguments: arguments,
        lambda arguments: nothing,
        lambda arguments, carry, step: carry,
        lambda arguments, carry, step: function(*arguments),
        example,
        lanes=lanes,
        driver=driver,
        cache=cache,
    )

    def run(*arguments: Any) -> Any:
        _, recorded = loop.run(arguments, steps=0, every=1)
        return jax.tree.map(lambda leaf: leaf[:, 0], recorded)

    return run
