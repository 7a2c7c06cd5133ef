"""Speed workloads: W1, ODIN with full motor models at 1 kHz, and W2, BlueROV2 Heavy in current and waves at 100 Hz."""

import math
from collections.abc import Mapping
from typing import Any, NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np

from undertow.scenario.build import build
from undertow.scenario.prepare import prepare
from undertow.simulation.loop.loop_runs import LoopRun, RunPlan
from undertow.simulation.loop.simd_batch import SimdBatchRunner

# Table 1 except for gamma_eps and the weight bound: without it the weights drift, and the loop diverges at about 135 s.
W1: dict[str, Any] = {
    "description": "W1",
    "plant": {
        "kind": "hybrid_vehicle",
        "vehicle": "odin",
        "thruster": {"kind": "paper_table3", "fidelity": "electromechanical"},
        "ledger": False,  # these runs are timed
    },
    "controller": {"kind": "paper", "composite": 20.0, "weights_bound": 20.0},
    "reference": {"kind": "setpoint", "position": [2, 3, 4, math.pi / 3, math.pi / 4, 2 * math.pi / 5]},
    "disturbance": "u1",
    "loop": {"kind": "sampled", "duration": 20.0},
}

# A typical scenario: examples/bluerov2_heavy.yaml.
_SENSORS = [
    "imu",
    {"kind": "dvl", "period": 0.125, "noise": 0.005, "delay": 0.05},
    "depth",
    "compass",
    {"kind": "position_fix", "period": 1, "noise": 0.05, "delay": 0.2},
]
W2: dict[str, Any] = {
    "description": "W2",
    "plant": {"vehicle": "bluerov2_heavy", "thruster": {"kind": "t200", "supply": 16}, "ledger": False},
    "model": {"rate_term": True},
    "controller": {"kind": "robust"},
    "reference": {"kind": "setpoint", "position": [2, 1, 1, 0, 0, 0.5], "settling": 20},
    "disturbance": [{"kind": "current", "velocity": [0.3, 0.2, 0]}, {"kind": "waves", "height": 0.5, "period": 5}],
    "navigation": {"kind": "observer", "sensors": _SENSORS},
    "loop": {"kind": "sampled", "dt": 0.01, "duration": 120, "record": 0.05},
}


class Workload(NamedTuple):
    """One workload; only metrics are recorded."""

    run: LoopRun
    plan: RunPlan

    @property
    def steps(self) -> int:
        """Steps of one run."""
        return self.plan.steps


def workload(data: Mapping[str, Any]) -> Workload:
    """A scenario of the sampled loop as a workload."""
    prepared = prepare(build(data))
    return Workload(prepared.run, prepared.plan)


def constant(run: LoopRun) -> list[bool]:
    """Which numbers are equal in `several`: all except the initial position."""
    all_constant = jax.tree.map(lambda leaf: True, eqx.filter(run, eqx.is_array))
    return jax.tree.leaves(all_constant._replace(start=(False, True)))


def several(run: LoopRun, count: int) -> Any:
    """Numbers of `count` runs with different initial positions."""
    numbers = eqx.filter(run, eqx.is_array)
    stacked = jax.tree.map(lambda leaf: np.broadcast_to(np.asarray(leaf), (count, *leaf.shape)), numbers)
    places = np.random.default_rng(0).normal(scale=0.1, size=(count, *run.start[0].shape))
    return stacked._replace(start=(places.astype(run.start[0].dtype), stacked.start[1]))


def batch(job: Workload, width: int = 0, driver: Any = None) -> SimdBatchRunner:
    """Program of a workload; arguments as of `SimdBatchRunner`."""
    return SimdBatchRunner(job.run, job.plan, constant(job.run), width, driver)


def tracking(accumulated: Any) -> np.ndarray:
    """The check value of runs: rms of the error over all six outputs, metres and radians together."""
    squares, samples = accumulated[0].squares["error"], accumulated[0].samples
    return np.sqrt(np.asarray(squares).mean(-1) / np.asarray(samples))


def batch_of_one(run: LoopRun) -> Any:
    """Numbers of the run itself."""
    return jax.tree.map(lambda leaf: jnp.asarray(leaf)[None], eqx.filter(run, eqx.is_array))
