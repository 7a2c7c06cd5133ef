"""Estimated and measured cost of programs, by the batch compiler and by XLA: python benchmarks/compiler_estimates.py

Prints JSON: for each program its operations per step, and of both compilers seconds to compile and nanoseconds per step
and run of a batch on one core, estimated (simdjit/estimate.py) and measured. Programs: workloads W1 and W2, thrusters
and fuzzy sets as in compiler_scale.py, and elementary functions of long arrays.
"""

import json
import os
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

from undertow.core import process_setup

process_setup.prepare()

import compiler_scale  # on one core
import jax
import jax.numpy as jnp
import numpy as np

from simdjit import Loop, estimate
from undertow.core import runtime
from undertow.simulation.loop.vmap_batch import XlaBatchRunner
from undertow.studies.speed import workload

RUNS, STEPS = 64, 200


def timed(work: Callable[[], Any]) -> tuple[Any, float]:
    """Result and seconds of the processor, which other processes do not change."""
    begun = time.process_time()
    return work(), time.process_time() - begun


def figures(
    program: Any, operations: int, traced: Any, compiling: tuple[float, float], runs: tuple[Callable, Callable]
):
    each = 1e9 / (STEPS * RUNS)
    steps = [min(timed(run)[1] for _ in range(3)) * each for run in runs]
    costs = estimate.compiled_here(operations), estimate.compiled_by_xla(traced)
    names = ("simdjit", "xla")
    found: dict[str, Any] = {"operations": program.operations}
    for name, cost, seconds, step in zip(names, costs, compiling, steps, strict=True):
        pairs = {"compile_s": (cost.compiling, seconds), "step_ns": (cost.step, step)}
        found[name] = {key: {"estimated": round(a, 2), "measured": round(b, 2)} for key, (a, b) in pairs.items()}
    return found


def of_scenario(data: dict[str, Any]) -> dict[str, Any]:
    """Figures of a scenario."""
    with runtime.on_processor():
        one = workload.workload(data)
        one = one._replace(plan=one.plan._replace(steps=STEPS))
        numbers, seen = workload.several(one.run, RUNS), []
        reason, estimate.reason_for_xla = estimate.reason_for_xla, lambda *given: seen.append(given) or ""
        try:
            program, compiling = timed(lambda: workload.batch(one))
        finally:
            estimate.reason_for_xla = reason
        other, waited = timed(lambda: XlaBatchRunner(one.run, one.plan, width=RUNS))
        arrays = jax.tree.map(jnp.asarray, numbers)
        operations, traced, _ = seen[0]
        return figures(
            program, operations, traced, (compiling, waited), (lambda: program.run(numbers), lambda: other.run(arrays))
        )


def of_functions(size: int) -> dict[str, Any]:
    """Figures of a sine and an exponential of each entry of an array."""
    step = lambda n, carry, k: jnp.sin(carry * n) + 0.1 * jnp.exp(-carry * carry) * n
    example = np.linspace(0.1, 1, size)
    given = np.broadcast_to(example, (RUNS, size)).copy()
    program, compiling = timed(lambda: Loop(lambda n: n, lambda n: n * 1.0, step, lambda n, c, k: c[0], example))
    repeated = jax.jit(jax.vmap(lambda n: jax.lax.fori_loop(0, STEPS, lambda k, c: step(n, c, k), n)))
    compiled, waited = timed(lambda: repeated.lower(given).compile())
    traced = jax.make_jaxpr(lambda n, c: step(n, c, 0))(example, example)
    runs = lambda: program.run(given, STEPS), lambda: jax.block_until_ready(compiled(given))
    return figures(program, program.operations, traced, (compiling, waited), runs)


def main() -> None:
    with tempfile.TemporaryDirectory() as name:
        os.environ["UNDERTOW_CACHE"] = os.environ["SIMDJIT_CACHE"] = name
        found = {"W1": of_scenario(workload.W1), "W2": of_scenario(workload.W2)}
        found |= {f"{n} thrusters": of_scenario(compiler_scale.scenario_with_thrusters(n, Path(name))) for n in (8, 32)}
        found |= {f"{n} sets": of_scenario(compiler_scale.scenario_with_sets(n)) for n in (20, 100)}
        found |= {f"functions of {n}": of_functions(n) for n in (100, 300, 1000)}
    print(json.dumps(found, indent=1))


if __name__ == "__main__":
    main()
