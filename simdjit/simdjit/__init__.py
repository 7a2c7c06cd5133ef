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

Names are loaded when first used: `import simdjit` by itself is quick.
"""

import importlib
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from simdjit import c99 as c99
    from simdjit.batch_function import compile as compile
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

# Public name -> module.
_HOMES = {
    "BatchStep": "simdjit.batch_step",
    "Driver": "simdjit.cuda",
    "Loop": "simdjit.loop",
    "PortableProgram": "simdjit.portable",
    "Step": "simdjit.step",
    "Unsupported": "simdjit.graph",
    "cached": "simdjit.cache",
    "compile": "simdjit.batch_function",
    "default_folder": "simdjit.cache",
    "gpu": "simdjit.nvidia",
    "simd_width": "simdjit.cpu",
}


def __getattr__(name: str) -> Any:
    if name == "c99":
        return importlib.import_module("simdjit.c99")
    if name in _HOMES:
        return getattr(importlib.import_module(_HOMES[name]), name)
    raise AttributeError(f"simdjit has no `{name}`. It has: {', '.join(__dir__())}")


def __dir__() -> list[str]:
    return sorted(("c99", *_HOMES))
