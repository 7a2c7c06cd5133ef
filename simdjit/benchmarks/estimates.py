"""Estimated and measured cost of programs, by simdjit and by XLA: python benchmarks/estimates.py

A step takes a sine and an exponential of each entry of an array of 100 to 1000 numbers. Prints JSON: for each program
its operations per step, and of both compilers seconds to compile and nanoseconds per step and run of a batch on one
core, estimated (simdjit/estimate.py) and measured.
"""

import json
import os
import tempfile
import time
from collections.abc import Callable
from typing import Any

import against_xla  # on one core
import jax
import jax.numpy as jnp
import numpy as np

from simdjit import Loop, estimate

RUNS, STEPS = against_xla.RUNS, 200


def timed(work: Callable[[], Any]) -> tuple[Any, float]:
    """Result and seconds of the processor, which other processes do not change."""
    begun = time.process_time()
    return work(), time.process_time() - begun


def figures(
    program: Any, operations: int, traced: Any, compiling: tuple[float, float], runs: tuple[Callable, Callable]
) -> dict[str, Any]:
    """Estimates beside what was measured.

    Args:
        program: compiled by simdjit.
        operations: of a step, but for those in loops over memory.
        traced: jaxpr of a step.
        compiling: seconds, by simdjit and by XLA.
        runs: all steps of the batch, by simdjit and by XLA.
    """
    each = 1e9 / (STEPS * RUNS)
    steps = [min(timed(run)[1] for _ in range(3)) * each for run in runs]
    costs = estimate.compiled_here(operations), estimate.compiled_by_xla(traced)
    table: dict[str, Any] = {"operations": program.operations}
    for name, cost, seconds, step in zip(("simdjit", "xla"), costs, compiling, steps, strict=True):
        pairs = {"compile_s": (cost.compiling, seconds), "step_ns": (cost.step, step)}
        table[name] = {
            key: {"estimated": round(estimated, 2), "measured": round(measured, 2)}
            for key, (estimated, measured) in pairs.items()
        }
    return table


def of_functions(size: int) -> dict[str, Any]:
    """Figures of a sine and an exponential of each entry of an array."""
    step = lambda n, carry, k: jnp.sin(carry * n) + 0.1 * jnp.exp(-carry * carry) * n
    example = np.linspace(0.1, 1, size)
    numbers = np.broadcast_to(example, (RUNS, size)).copy()
    program, compiling = timed(lambda: Loop(lambda n: n, lambda n: n * 1.0, step, lambda n, c, k: c[0], example))
    repeated = jax.jit(jax.vmap(lambda n: jax.lax.fori_loop(0, STEPS, lambda k, c: step(n, c, k), n)))
    compiled, waited = timed(lambda: repeated.lower(numbers).compile())
    traced = jax.make_jaxpr(lambda n, c: step(n, c, 0))(example, example)
    runs = lambda: program.run(numbers, STEPS), lambda: jax.block_until_ready(compiled(numbers))
    return figures(program, program.operations, traced, (compiling, waited), runs)


def main() -> None:
    with tempfile.TemporaryDirectory() as folder:
        os.environ["SIMDJIT_CACHE"] = folder
        print(json.dumps({f"functions of {size}": of_functions(size) for size in (100, 300, 1000)}, indent=1))


if __name__ == "__main__":
    main()
