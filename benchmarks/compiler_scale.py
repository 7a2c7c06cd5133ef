"""How the batch compiler scales: python benchmarks/compiler_scale.py [thrusters|sets]

thrusters: BlueROV2 Heavy's body with 8, 16 and 32 T200 under preset `robust` at 100 Hz.
sets: workload W1 with 5 to 100 fuzzy sets on each axis.

Prints JSON: operations per step, seconds to compile, and nanoseconds per step and run in a batch of 64, by simdjit and
by XLA (`jax.vmap` of the same batch). All are processor time on one core, on which other processes have little effect.
The same figures of products of matrices: simdjit/benchmarks/against_xla.py.
"""

import argparse
import json
import math
import os
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

from undertow.core import process_setup

process_setup.prepare()
ROOT = Path(__file__).parents[1]
sys.path.insert(0, str(ROOT / "simdjit/benchmarks"))

import jax
import jax.numpy as jnp
from against_xla import RUNS, STEPS, figures
from timing import REPETITIONS, shortest

from simdjit import Unsupported
from undertow.core import runtime
from undertow.scenario.reading import parse
from undertow.simulation.loop.vmap_batch import XlaBatchRunner
from undertow.studies.speed import workload

VEHICLE = ROOT / "examples" / "my_rov.yaml"  # BlueROV2 Heavy


def ring(count: int) -> list[dict[str, Any]]:
    """Thrusters on two rings: half of them horizontal at 45 degrees to the ring, half of them vertical."""
    placed = []
    for i in range(count):
        turn = 2 * math.pi * (i // 2 + 0.5) / (count // 2)
        side = math.pi / 4 if i // 2 % 2 else -math.pi / 4
        across = [math.cos(turn + math.pi / 2 + side), math.sin(turn + math.pi / 2 + side), 0.0]
        position = [0.25 * math.cos(turn), 0.25 * math.sin(turn), 0.05]
        placed.append({"position": position, "direction": across if i % 2 else [0.0, 0.0, -1.0]})
    return placed


def scenario_with_thrusters(count: int, folder: Path) -> dict[str, Any]:
    """BlueROV2 Heavy with other thrusters."""
    path = folder / f"thrusters{count}.yaml"
    given = parse(VEHICLE.read_text("utf-8"), VEHICLE.name, VEHICLE.parent).data
    del given["thruster_matrix"]  # that of its own thrusters
    path.write_text(json.dumps(given | {"thrusters": ring(count)}))
    plant = {"vehicle": str(path), "thruster": {"kind": "t200", "supply": 16}, "ledger": False}
    return {
        "plant": plant,
        "controller": {"kind": "rcaf", "preset": "robust"},
        "reference": {"kind": "setpoint", "position": [2, 1, 1, 0, 0, 0.5], "settling": 20},
        "disturbance": {"kind": "current", "velocity": [0.3, 0.2, 0]},
        "loop": {"kind": "sampled", "dt": 0.01, "duration": STEPS * 0.01, "record": 0.1},
    }


def scenario_with_sets(count: int) -> dict[str, Any]:
    """Workload W1 with another number of fuzzy sets."""
    law = {**workload.W1["controller"], "sets": count}
    return workload.W1 | {"controller": law, "loop": {"kind": "sampled", "duration": STEPS * 1e-3}}


def of_scenario(data: dict[str, Any]) -> dict[str, float | str]:
    """Figures of a scenario, or why the batch compiler leaves it to XLA."""
    with runtime.on_processor():
        one = workload.workload(data)
        numbers = workload.several(one.run, RUNS)
        begun = time.process_time()
        try:
            program = workload.batch(one)
        except Unsupported as lacking:
            return {"left_to_xla": str(lacking)}
        compiling = time.process_time() - begun
        by_simdjit = shortest(lambda: program.run(numbers))
        begun = time.process_time()
        other, arrays = XlaBatchRunner(one.run, one.plan, width=RUNS), jax.tree.map(jnp.asarray, numbers)
        by_xla = shortest(lambda: other.run(arrays))
        waited = time.process_time() - begun - REPETITIONS * by_xla
    each = 1e9 / (one.steps * RUNS)
    return figures(program.operations, compiling, by_simdjit * each, waited, by_xla * each)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    kinds = ("thrusters", "sets")
    parser.add_argument("what", nargs="*", choices=[*kinds, []], default=[])
    asked = parser.parse_args().what or kinds
    with tempfile.TemporaryDirectory() as name:
        os.environ["UNDERTOW_CACHE"] = name
        folder, found = Path(name), {}
        if "thrusters" in asked:
            found["thrusters"] = {n: of_scenario(scenario_with_thrusters(n, folder)) for n in (8, 16, 32)}
        if "sets" in asked:
            found["sets"] = {n: of_scenario(scenario_with_sets(n)) for n in (5, 20, 50, 100)}
    print(json.dumps(found, indent=1))


if __name__ == "__main__":
    main()
