"""Estimated and measured cost of programs, by the batch compiler and by XLA: python benchmarks/compiler_estimates.py

Prints JSON: for each program its operations per step, and of both compilers seconds to compile and nanoseconds per step
and run of a batch on one core, estimated (simdjit/estimate.py) and measured. Programs: workloads W1 and W2, thrusters
and fuzzy sets as in compiler_scale.py. Those of elementary functions of long arrays: simdjit/benchmarks/estimates.py.
"""

import json
import os
import tempfile
from pathlib import Path
from typing import Any

from undertow.core import process_setup

process_setup.prepare()

import compiler_scale  # on one core
import jax
import jax.numpy as jnp
from estimates import RUNS, STEPS, figures, timed

from simdjit import estimate
from undertow.core import runtime
from undertow.simulation.loop.vmap_batch import XlaBatchRunner
from undertow.studies.speed import workload


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


def main() -> None:
    with tempfile.TemporaryDirectory() as name:
        os.environ["UNDERTOW_CACHE"] = os.environ["SIMDJIT_CACHE"] = name
        found = {"W1": of_scenario(workload.W1), "W2": of_scenario(workload.W2)}
        found |= {f"{n} thrusters": of_scenario(compiler_scale.scenario_with_thrusters(n, Path(name))) for n in (8, 32)}
        found |= {f"{n} sets": of_scenario(compiler_scale.scenario_with_sets(n)) for n in (20, 100)}
    print(json.dumps(found, indent=1))


if __name__ == "__main__":
    main()
