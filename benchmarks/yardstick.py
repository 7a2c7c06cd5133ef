"""Workload W1 in hand-written C++ beside undertow: python benchmarks/yardstick.py [--rounds 5] [--json]

Compiles benchmarks/yardstick/w1.cpp, compares its trajectory and metrics with undertow's, and measures nanoseconds per
step: of the C++ on one core, of one run of undertow, and of a batch on all cores. The shortest time of all rounds
counts, because other processes only ever lengthen it. The C++ program counts its processor time, undertow the time on
the wall.

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
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from undertow import process_setup

process_setup.prepare()

import numpy as np

from undertow.analysis.metrics import results_of_batch
from undertow.bench import measure, workload
from undertow.bench.workload import W1
from undertow.core import runtime
from undertow.core.errors import BadInput
from undertow.scenario.build import build
from undertow.scenario.execute import execute

SOURCE = Path(__file__).parent / "yardstick" / "w1.cpp"
# No -ffast-math: sums keep their order. The compiler may use the vector units as it likes, and contract to fused
# operations, which undertow does not.
FLAGS = ("-std=c++17", "-O3", "-march=native")
RUNS = 20  # of 20 000 steps, in a round
COMPARED_S = 0.2  # of the trajectory
# Roundings differ, and weights that meet their bound carry a difference on: the metrics of 20 s differ by more.
SAME_TRAJECTORY, SAME_METRICS = 1e-9, 1e-6


def constants() -> dict[str, Any]:
    """Numbers of W1, by their names in the C++ program; from undertow's parts, so that none is typed twice."""
    with runtime.in_precision("float64"):
        built = build(W1)
        plant, law = built.closed_loop.plant, built.closed_loop.controller
        body, motor, dynamics = plant.body, plant.thruster.motor, law.model.dynamics
        lyapunov, (centres,), (widths,) = law.lyapunov(), law.fuzzy.centres, law.fuzzy.widths
        centres, width = np.asarray(centres), float(widths[0])
        spacing = float(centres[1] - centres[0])
        return {
            "PI": math.pi,
            "DT": built.scenario.loop.dt,
            "INWARD": 1e-9,  # undertow/numerics/integrators.py
            "ENVELOPE": 1e3,  # undertow/plants/hybrid_vehicle.py
            "SETTLED": 0.02,  # undertow/analysis/metrics.py
            "TARGET": built.closed_loop.reference.position,
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


def compiled(folder: Path, numbers: Mapping[str, Any]) -> Path:
    """The C++ program, compiled into a folder.

    Raises:
        BadInput: there is no compiler, or it fails.
    """
    compiler = os.environ.get("CXX", "c++")
    if shutil.which(compiler) is None:
        hint = "Install g++ or clang++, or name another one in the environment variable CXX"
        raise BadInput("", "", f"there is no C++ compiler `{compiler}`", hint=hint)
    (folder / "w1_constants.h").write_text(header(numbers), encoding="utf-8")
    program = folder / "w1"
    command = [compiler, *FLAGS, "-Wall", "-Wextra", "-I", str(folder), "-o", str(program), str(SOURCE)]
    done = subprocess.run(command, capture_output=True, text=True)
    if done.returncode != 0 or done.stderr:
        raise BadInput("", "", f"`{compiler}` does not compile {SOURCE.name} without a warning: {done.stderr}")
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


def named(program: Path, *arguments: object) -> dict[str, float]:
    """Numbers that the C++ program prints with their names."""
    return {name: float(value) for name, value in printed(program, *arguments)}


def trajectory_difference(program: Path) -> float:
    """Largest difference of outputs (m, rad) and voltages (relative to the largest) from undertow's, step by step."""
    dt = 1e-3
    loop = {"kind": "sampled", "duration": COMPARED_S, "dt": dt, "record": dt}
    record = execute(W1 | {"loop": loop}).dataset
    ours = [record[name].values[:-1] for name in ("position", "input")]
    rows = np.array(printed(program, "trajectory", len(ours[0])), dtype=float)
    outputs, voltages = rows[:, 1:7], rows[:, 7:]
    return float(max(np.abs(outputs - ours[0]).max(), np.abs(voltages / ours[1] - 1).max()))


def metrics_differences(program: Path) -> dict[str, float]:
    """Relative difference of each metric of W1 from undertow's."""
    with runtime.on_processor(), runtime.in_precision("float64"):
        one = workload.workload(W1)
        accumulated = workload.batch(one, width=1).run(workload.alone(one.run)).accumulated
        ours = {name: float(value[0]) for name, value in results_of_batch(one.run.accumulators, accumulated).items()}
        ours["tracking_rms"] = float(workload.tracking(accumulated)[0])
    theirs = named(program, "metrics", one.steps)
    return {name: abs(value / ours[name] - 1) for name, value in theirs.items()}


if __name__ == "__main__":
    import time
    with tempfile.TemporaryDirectory() as name:
        p = compiled(Path(name), constants())
        print(trajectory_difference(p))
        print(metrics_differences(p))
        print(named(p, "time", 20000, 20))
