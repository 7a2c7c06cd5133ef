"""What steps of higher order bring between two samples of a controller: python benchmarks/integration_error.py

Three closed loops with their controllers' own sampling times: the example inverted pendulum, and workloads W1 and W2.
The error is the largest difference in position from the same loop with 32 Runge-Kutta steps a sample. Order 8 is the
method DOP853 with fixed steps, whose coefficients are SciPy's. Times are processor time of a single run.
"""

import sys
from pathlib import Path

from undertow.core import process_setup

process_setup.prepare()
ROOT = Path(__file__).parents[1]
sys.path.insert(0, str(ROOT / "simdjit/benchmarks"))

import jax
import numpy as np
from scipy.integrate import DOP853
from timing import shortest

from undertow.core import runtime
from undertow.core.numerics import integrators
from undertow.scenario.build import Built, build
from undertow.scenario.reading import read
from undertow.simulation.loop import sampled, simd_batch

LOOPS = {"inverted_pendulum": 5.0, "w1": 5.0, "bluerov2_heavy": 20.0}  # files of examples/, and s
METHODS = (("euler", 1), ("euler", 4), ("rk4", 1), ("rk4", 2), ("rk4", 4), ("dop853", 1))  # and steps of a sample
STAGES = {"euler": 1, "rk4": 4, "dop853": DOP853.n_stages}
EXAMPLES = ROOT / "examples"


def dop853(field, t, y, dt):
    """One step of order 8; arguments and result as in undertow/core/numerics/integrators.py."""
    inside = (integrators.first_stage(0.0, 1.0), 1 - integrators.first_stage(0.0, 1.0))
    slopes = []
    for reach, weights in zip(DOP853.C, DOP853.A[: DOP853.n_stages], strict=False):
        at = moved(y, slopes, weights, dt)
        slopes.append(field(t + float(np.clip(reach, *inside)) * dt, at))
    return moved(y, slopes, DOP853.B, dt)


def moved(y, slopes, weights, dt):
    """State y after dt with the weighted sum of slopes."""
    used = [(float(weight), slope) for weight, slope in zip(weights, slopes, strict=False) if weight]
    add = lambda here, *rates: here + dt * sum(weight * rate for (weight, _), rate in zip(used, rates, strict=True))
    return jax.tree.map(add, y, *(slope for _, slope in used)) if used else y


def position(built: Built, method: str, substeps: int, duration: float, simulate=simd_batch.simulate) -> np.ndarray:
    """Recorded positions of one run."""
    start = built.scenario.initial
    outcome = simulate(
        built.closed_loop,
        duration=duration,
        dt=built.scenario.loop.dt,
        record_every=1,
        method=method,
        substeps=substeps,
        position=start.position,
        velocity=start.velocity,
    )
    return np.asarray(outcome.signals["position"])


def rows(name: str, duration: float):
    """Method, steps of a sample, evaluations of the plant, largest error, and ns per sample."""
    built = build(read(EXAMPLES / f"{name}.yaml"))
    samples = round(duration / built.scenario.loop.dt)
    # By XLA, which keeps so many steps a loop.
    true = position(built, "rk4", 32, duration, sampled.simulate)
    for method, substeps in METHODS:
        work = lambda method=method, substeps=substeps: position(built, method, substeps, duration)
        error = np.abs(work() - true).max()
        yield method, substeps, STAGES[method] * substeps, error, 1e9 * shortest(work) / samples


def main() -> None:
    integrators.METHODS["dop853"] = integrators.COMPACT_METHODS["dop853"] = dop853
    print("| loop | method | steps of a sample | evaluations | largest error, m or rad | ns per sample |")
    print("|---|---|---|---|---|---|")
    with runtime.in_precision("float64"):
        for name, duration in LOOPS.items():
            for method, substeps, evaluations, error, ns in rows(name, duration):
                print(f"| {name} | {method} | {substeps} | {evaluations} | {error:.1e} | {ns:,.0f} |", flush=True)


if __name__ == "__main__":
    main()
