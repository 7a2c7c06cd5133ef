"""How programs scale, by simdjit and by XLA: python benchmarks/against_xla.py

A step X <- A X + B of square matrices with 8 to 48 rows, as a filter of so many states needs it. Prints JSON:
operations per step, seconds to compile, and nanoseconds per step and run in a batch of 64, by simdjit and by XLA
(`jax.vmap` of the same batch). All are processor time on one core, on which other processes have little effect.
"""

import json
import tempfile
import time
from pathlib import Path

import jax
import numpy as np
from timing import REPETITIONS, shortest

from simdjit import Loop

jax.config.update("jax_enable_x64", True)

RUNS, STEPS = 64, 400
ROWS = (8, 12, 15, 16, 24, 32, 48)


def figures(operations: int, compiling: float, by_simdjit: float, xla_compiling: float, by_xla: float):
    """Figures of a program: seconds to compile, and nanoseconds per step and run."""
    measured = {"operations": operations, "simdjit_compile_s": compiling, "simdjit_ns": by_simdjit}
    measured |= {"xla_compile_and_first_run_s": xla_compiling, "xla_ns": by_xla}
    return {key: float(f"{value:.4g}") for key, value in measured.items()}


def of_product(rows: int, cache: Path) -> dict[str, float]:
    """Figures of a product of matrices."""
    chance = np.random.default_rng(0)
    matrices = chance.normal(size=(RUNS, rows, rows)) / rows, chance.normal(size=(RUNS, rows, rows))
    step = lambda numbers, carry, k: numbers[0] @ carry + numbers[1]
    begun = time.process_time()
    example = tuple(matrix[0] for matrix in matrices)
    program = Loop(lambda n: n, lambda n: n[1] * 1.0, step, lambda n, c, k: c[0, 0], example, cache=cache)
    compiling = time.process_time() - begun
    by_simdjit = shortest(lambda: program.run(matrices, STEPS))
    repeated = jax.jit(jax.vmap(lambda *n: jax.lax.fori_loop(0, STEPS, lambda k, c: step(n, c, k), n[1])))
    begun = time.process_time()
    by_xla = shortest(lambda: jax.block_until_ready(repeated(*matrices)))
    waited = time.process_time() - begun - REPETITIONS * by_xla
    each = 1e9 / (STEPS * RUNS)
    return figures(program.operations, compiling, by_simdjit * each, waited, by_xla * each)


def main() -> None:
    with tempfile.TemporaryDirectory() as folder:
        print(json.dumps({"products": {rows: of_product(rows, Path(folder)) for rows in ROWS}}, indent=1))


if __name__ == "__main__":
    main()
