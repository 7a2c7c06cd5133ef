"""Workload W1 in hand-written C++ beside undertow: python benchmarks/yardstick.py [--rounds 5] [--json]

Compiles benchmarks/yardstick/w1.cpp with the FLAGS below, compares its trajectory and metrics with undertow's, and
prints nanoseconds per step and run, beside those of one run of undertow and of batches. The shortest of all rounds
counts, because other processes only lengthen it. Times are processor time on one core. The batch on all cores is also
measured on the wall, as `undertow bench` does; its processor time divided by the cores is what that comes to where
nothing else runs.

The compiler is `c++`, or that in the environment variable CXX.
"""

import argparse
import json
import math
import os
import shutil
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any, NamedTuple

from undertow.core import process_setup

process_setup.prepare()

import numpy as np

from undertow.analysis.metrics import results_of_batch
from undertow.core import runtime
from undertow.core.errors import BadInput
from undertow.scenario.build import build
from undertow.scenario.results.run_scenario import run_scenario
from undertow.simulation.loop.simd_batch import Unsupported
from undertow.studies.speed import workload
from undertow.studies.speed.workload import W1

SOURCE = Path(__file__).parent / "yardstick" / "w1.cpp"
# No -ffast-math: sums keep their order. The compiler may use the vector units as it likes, and contract to fused
# operations, which undertow does not.
FLAGS = ("-std=c++17", "-O3", "-march=native")
COMPARED_S = 0.2  # s of the trajectory
SAME = 1e-9  # largest difference of trajectory and metrics; roundings make one of some 1e-12
REPETITIONS = 7  # in a round
TOGETHER = 64  # runs of a batch and thread, as in undertow/studies/speed/measure.py


def constants() -> dict[str, Any]:
    """Numbers of W1, by their names in the C++ program; from undertow's parts, so that none is typed twice."""
    with runtime.in_precision("float64"):
        built = build(W1)
        plant: Any = built.closed_loop.plant
        law: Any = built.closed_loop.controller
        target: Any = built.closed_loop.reference
        body, motor, dynamics = plant.body, plant.thruster.motor, law.model.dynamics
        lyapunov, (centres,), (widths,) = law.lyapunov(), law.fuzzy.centres, law.fuzzy.widths
        centres, width = np.asarray(centres), float(widths[0])
        spacing = float(centres[1] - centres[0])
        return {
            "PI": math.pi,
            "DT": built.scenario.loop.dt,
            "INWARD": 1e-9,  # undertow/core/numerics/integrators.py
            "ENVELOPE": 1e3,  # m, m/s, rad/s; this and the next: undertow/physics/plants/hybrid_vehicle.py
            "LEAST_COSINE": 1e-3,  # of the pitch
            "SETTLED": 0.02,  # undertow/analysis/metrics.py
            "TARGET": target.position,
            "MASS": body.mass_matrix,
            "INVERSE_MASS": body.inverse_mass_matrix,
            "LINEAR_DAMPING": diagonal(body.linear_damping),
            "QUADRATIC_DAMPING": diagonal(body.quadratic_damping),
            "NET_WEIGHT": body.weight - body.buoyancy,
            "RIGHTING_LEVER": body.weight * body.r_g - body.buoyancy * body.r_b,
            "THRUSTER_MATRIX": plant.thruster_matrix,
            "R": motor.resistance,
            "L": motor.inductance,
            "K_T": motor.torque_constant,
            "K_E": motor.back_emf_constant,
            "K_F": motor.friction,
            "J_ROTOR": motor.rotor_inertia,
            "C_T": motor.thrust_coefficient,
            "C_Q": motor.torque_coefficient,
            "ACCELERATION_PER_VOLT": dynamics.body_gain,
            "VOLTAGE_PER_ACCELERATION": dynamics.allocation @ body.mass_matrix,
            "K_1": law.feedback[0],
            "K_2": law.feedback[1],
            "P_12": lyapunov[0, 1],
            "P_22": lyapunov[1, 1],
            "ROBUST_GAIN": law.robust_gain,
            "LAYER": law.layer,
            "POLE": law.identification.pole,
            "COMPENSATION_GAIN": law.identification.compensation_gain,
            "COMPENSATION_LAYER": law.identification.compensation_layer,
            "ADAPTATION": law.adaptation,
            "COMPOSITE": law.composite,
            "WEIGHTS_BOUND": law.weights_bound,
            "OUTERMOST": centres[-1],
            "BASIS_SLOPE": 2 * spacing / width**2,
            "INWARD_WEIGHT": np.exp(-((np.arange(len(centres)) * spacing / width) ** 2)),
        }


def diagonal(matrix: Any) -> np.ndarray:
    """The diagonal of a matrix that has nothing else, as the C++ program assumes of ODIN's damping.

    Raises:
        BadInput: it has.
    """
    values = np.asarray(matrix)
    if np.any(values != np.diag(np.diag(values))):
        raise BadInput("damping", "be diagonal for the C++ program", values.tolist())
    return np.diag(values)


def header(numbers: Mapping[str, Any]) -> str:
    """w1_constants.h: the numbers in hexadecimal, which have every bit."""
    rules, thrusters = len(numbers["INWARD_WEIGHT"]), len(numbers["VOLTAGE_PER_ACCELERATION"])
    lines = [f"constexpr std::size_t SETS = {rules}, THRUSTERS = {thrusters};"]
    for name, value in numbers.items():
        values = np.asarray(value, dtype=float)
        kind = ["double", "Vector<{}>", "Matrix<{}, {}>"][values.ndim].format(*values.shape)
        lines.append(f"constexpr {kind} {name} = {_braced(values)};")
    return "\n".join(lines) + "\n"


def _braced(values: np.ndarray) -> str:
    if values.ndim == 0:
        return float(values).hex()
    inner = ", ".join(_braced(row) for row in values)
    return f"{{{inner}}}" if values.ndim == 1 else f"{{{{{inner}}}}}"


def compiler_name() -> str:
    """The C++ compiler.

    Raises:
        BadInput: there is none.
    """
    name = os.environ.get("CXX", "c++")
    if shutil.which(name) is None:
        hint = "Install g++ or clang++, or name another one in the environment variable CXX"
        raise BadInput("", "", f"there is no C++ compiler `{name}`", hint=hint)
    return name


def version() -> str:
    """The first line that the compiler says of itself."""
    return subprocess.run([compiler_name(), "--version"], capture_output=True, text=True).stdout.partition("\n")[0]


def compiled(folder: Path, numbers: Mapping[str, Any]) -> Path:
    """The C++ program, compiled into a folder.

    Raises:
        BadInput: there is no compiler, or it fails.
    """
    compiler = compiler_name()
    (folder / "w1_constants.h").write_text(header(numbers), encoding="utf-8")
    program = folder / "w1"
    command = [compiler, *FLAGS, "-Wall", "-Wextra", "-I", str(folder), "-o", str(program), str(SOURCE)]
    done = subprocess.run(command, capture_output=True, text=True)
    if done.returncode != 0 or done.stderr:
        said = next((line for line in done.stderr.splitlines() if "error" in line or "warning" in line), done.stderr)
        raise BadInput("", "", f"`{compiler}` does not compile {SOURCE.name} without a warning: {said}")
    return program


def printed(program: Path, *arguments: object) -> list[list[str]]:
    """Words of each line that the C++ program prints.

    Raises:
        BadInput: it fails.
    """
    done = subprocess.run([str(program), *map(str, arguments)], capture_output=True, text=True)
    if done.returncode != 0:
        raise BadInput("", "", f"the C++ program ended with exit code {done.returncode}: {done.stderr}")
    return [line.split() for line in done.stdout.splitlines()]


def timed_metrics(program: Path, steps: int, runs: int) -> tuple[dict[str, float], float]:
    """Metrics of the C++ program, and its nanoseconds per step, the shortest of some runs."""
    found = {name: float(value) for name, value in printed(program, "metrics", steps, runs)}
    return found, found.pop("ns_per_step")


def trajectory_difference(program: Path) -> float:
    """Largest difference from undertow's run, step by step: of outputs in m, rad, of voltages as shares of the peak."""
    loop = {"kind": "sampled", "duration": COMPARED_S, "record": 1e-3}
    record = run_scenario(W1 | {"loop": loop}).dataset
    outputs, voltages = (record[name].values[:-1] for name in ("position", "input"))
    rows = np.array(printed(program, "trajectory", len(outputs)), dtype=float)
    apart = np.abs(rows[:, 7:] - voltages).max() / np.abs(voltages).max()
    return float(max(np.abs(rows[:, 1:7] - outputs).max(), apart))


def metrics_of_undertow(one: workload.Workload) -> dict[str, float]:
    """Metrics of one run of W1, and `tracking_rms`, as `undertow bench` prints it."""
    accumulated = workload.batch(one, width=1).run(workload.batch_of_one(one.run)).accumulated
    found = {name: float(value[0]) for name, value in results_of_batch(one.run.accumulators, accumulated).items()}
    return found | {"tracking_rms": float(workload.tracking(accumulated)[0])}


def compare(program: Path, one: workload.Workload) -> dict[str, float]:
    """Figures of the comparison with undertow.

    Raises:
        BadInput: trajectory or metrics differ.
    """
    apart = trajectory_difference(program)
    theirs, ours = timed_metrics(program, one.steps, 1)[0], metrics_of_undertow(one)
    differences = {name: abs(value / ours[name] - 1) for name, value in theirs.items()}
    worst = max(differences, key=differences.__getitem__)
    if not apart <= SAME:
        raise BadInput("w1.cpp", f"have undertow's trajectory to {SAME:g}", f"off by {apart:.3g} within {COMPARED_S} s")
    if not all(difference <= SAME for difference in differences.values()):
        raise BadInput("w1.cpp", f"have undertow's metrics to {SAME:g}", f"off by {differences[worst]:.3g} in {worst}")
    figures = {"tracking_rms": theirs["tracking_rms"], "undertow_tracking_rms": ours["tracking_rms"]}
    return figures | {"trajectory_difference": apart, "metrics_difference": differences[worst]}


class Timed(NamedTuple):
    """Nanoseconds per step and run: on the wall, and of all processor cores together."""

    wall: float
    processor: float


def timed(work: Callable[[], Any], steps: int) -> Timed:
    """Shortest times of some repetitions after a first one."""
    work()
    found = []
    for _ in range(REPETITIONS):
        begun = time.perf_counter(), time.process_time()
        work()
        found.append((time.perf_counter() - begun[0], time.process_time() - begun[1]))
    return Timed(*(1e9 * min(each) / steps for each in zip(*found, strict=True)))


def times(program: Path, one: workload.Workload, rounds: int) -> dict[str, float]:
    """Nanoseconds per step and run, the shortest of all rounds; each round measures everything."""
    threads = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
    single, batch = workload.batch(one, width=1), workload.batch(one)
    alone, several = workload.batch_of_one(one.run), workload.several(one.run, TOGETHER)
    found: dict[str, float] = {}

    def keep(name: str, value: float) -> None:
        found[name] = min(value, found.get(name, math.inf))

    with runtime.workers(threads) as pool:
        together = lambda: list(pool.map(lambda _: batch.run(several), range(threads)))
        for _ in range(rounds):
            keep("yardstick_ns", timed_metrics(program, one.steps, REPETITIONS)[1])
            keep("single_ns", timed(lambda: single.run(alone), one.steps).processor)
            keep("batch_one_thread_ns", timed(lambda: batch.run(several), TOGETHER * one.steps).processor)
            every = timed(together, threads * TOGETHER * one.steps)
            keep("batch_ns", every.wall)
            keep("batch_undisturbed_ns", every.processor / threads)
    ratio = lambda name: found["yardstick_ns"] / found[name]
    ratios = {f"{name}_times_yardstick": ratio(f"{name}_ns") for name in ("single", "batch", "batch_undisturbed")}
    return {"threads": threads} | found | ratios


_ROWS = {
    "yardstick_ns": "hand-written C++, one core",
    "single_ns": "undertow, one run, one core",
    "batch_one_thread_ns": "undertow, batch on one core",
    "batch_ns": "undertow, batch on all cores, on the wall",
    "batch_undisturbed_ns": "undertow, batch on all cores, processor time over cores",
}


def report(found: Mapping[str, Any]) -> str:
    """The figures as text."""
    lines = [
        f"w1.cpp compiled by {found['compiler']} with {found['flags']}",
        f"rms of all six errors {found['tracking_rms']:.8f}, of undertow {found['undertow_tracking_rms']:.8f}; largest "
        f"differences: trajectory {found['trajectory_difference']:.1g}, metrics {found['metrics_difference']:.1g}",
        f"{'nanoseconds per step of W1':<58}{'ns':>8}{'C++ over it':>13}",
    ]
    for name, words in _ROWS.items():
        lines.append(f"{words:<58}{found[name]:>8.4g}{found['yardstick_ns'] / found[name]:>13.3g}")
    return "\n".join(lines)


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--rounds", type=int, default=5)
    parser.add_argument("--json", action="store_true")
    options = parser.parse_args()
    try:
        if options.rounds < 1:
            raise BadInput("--rounds", "be 1 or more", options.rounds)
        with tempfile.TemporaryDirectory() as folder, runtime.on_processor(), runtime.in_precision("float64"):
            program, one = compiled(Path(folder), constants()), workload.workload(W1)
            found = {"compiler": version(), "flags": " ".join(FLAGS)} | compare(program, one)
            found |= times(program, one, options.rounds)
    except (BadInput, Unsupported) as wrong:
        print(f"Error: {wrong}", file=sys.stderr)
        return 2
    print(json.dumps(found, indent=1) if options.json else report(found))
    return 0


if __name__ == "__main__":
    sys.exit(main())
