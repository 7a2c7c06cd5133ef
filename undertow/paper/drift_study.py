"""Why Table 1 is stable with a lag that its linearised loop does not tolerate: weights that drift add damping.

Thrust follows the voltage with a lag of 50 ms, under one sinusoid per axis: once with free weights, once with weights
projected into a box that is too small for the drift.
"""

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from undertow.analysis.drift import gain_bound, gain_of
from undertow.analysis.motor_loop import lag_matrix, stable_gains
from undertow.paper.horizons import BOUND
from undertow.paper.lag_map import lag_thruster
from undertow.paper.running import BatchedRun, start_batches, write_all
from undertow.paper.setup import law_of, scenario
from undertow.simulation.processes import Tasks

LAG = 0.05  # s
_SECONDS = 20.0

# A stationary load: m/s^2 and rad/s^2, rad/s.
STATIONARY = {
    "kind": "sinusoid",
    "amplitude": [4.0, 3.0, 2.0, 2.0, 3.0, 4.0],
    "frequency": [0.5, 1.0, 2.0, 3.0, 4.0, 5.0],
}

_BIN = 200  # samples of 1 ms over which chattering is computed


def scenarios() -> dict[str, dict[str, Any]]:
    """Both runs, by name."""
    by_name = {}
    for name, words, bound in (("free", "weights free", float("inf")), ("bounded", "weights within 20", BOUND)):
        data = scenario(
            f"Table 1 with a lag of {1e3 * LAG:g} ms, {words}: one sinusoid per axis",
            fidelity="electromechanical",
            controller={"weights_bound": bound},
            disturbance=STATIONARY,
            loop={"kind": "sampled", "duration": _SECONDS, "record": 1e-3},
        )
        data["plant"]["thruster"] = lag_thruster(LAG)
        by_name[f"drifting_{name}"] = data
    return by_name


def start_runs(folder: Path, tasks: Tasks) -> Callable[[], dict[str, BatchedRun]]:
    """Begin both runs, and return what waits for them; `scenarios/` is written in a folder."""
    named = scenarios()
    write_all(named, folder)
    return start_batches(named, ((10.0, _SECONDS),), 1e-3, ("weights", "weights_peak", "input", "error"), tasks)


def drift_results(batched_runs: Mapping[str, BatchedRun]) -> dict[str, Any]:
    """Gain c of every axis, largest weight and chattering against time, and the c that the linearised loop needs.

    Args:
        batched_runs: both, by name.
    """
    law = law_of(batched_runs["drifting_free"])
    between = stable_gains(lambda gain: lag_matrix(law, LAG, drifted=gain), 6000.0)
    runs = {name.removeprefix("drifting_"): _curves(run) for name, run in batched_runs.items()}
    bounded = gain_bound(law_of(batched_runs["drifting_bounded"]))
    return {"lag": LAG, "needed": between and between[0], "bounded_gain": bounded, "runs": runs}


def _curves(run: BatchedRun) -> dict[str, Any]:
    """Every series at the ends of the bins."""
    gain = gain_of(law_of(run), run.series["weights"])
    ends = np.arange(_BIN, len(run.time), _BIN)
    moved = np.abs(np.diff(run.series["input"], axis=0)).mean(1)
    size = np.sqrt((run.series["error"] ** 2).mean(1))
    return {
        "time": run.time[ends].tolist(),
        "gain": gain[ends].T.tolist(),  # by axis
        "weights_peak": run.series["weights_peak"][ends].tolist(),
        "input_variation": [float(moved[end - _BIN : end].sum() / (1e-3 * _BIN)) for end in ends],
        "tracking": size[ends].tolist(),
        "steady": {key: run.windows[0][key] for key in ("tracking_rms", "input_variation", "weights_peak")}
        if run.windows[0]
        else None,
    }
