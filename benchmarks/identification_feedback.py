"""Dives whose inputs answer to the disturbance: both methods of `undertow identify` on dives with a controller.

A BlueROV2 Heavy follows a lively path by a PID, in waves or in a current that changes, with noise on all measurements.
Its drag along the axes is a third less than in the file. For both methods the script prints the rms of the errors over
the seeds, the mean of the stated deviations, and how many of the 95 % intervals contain the truth.

    python benchmarks/identification_feedback.py --seeds 6
"""

import argparse

import numpy as np

import undertow as ut
from undertow.studies.identification.estimates import METHODS

FREE = ("quadratic_damping.surge", "quadratic_damping.sway", "quadratic_damping.heave", "quadratic_damping.yaw", "lag")
TRUTH = {"quadratic_damping.surge": 94.0, "quadratic_damping.sway": 145.0, "quadratic_damping.heave": 127.0}
DISTURBANCES = {
    "none": "none",
    "waves": {"kind": "waves", "height": 0.5, "period": 4.0},
    "current": {
        "kind": "gauss_markov_current",
        "mean": [0.1, 0.1, 0.0],
        "deviation": [0.1, 0.1, 0.05],
        "correlation_time": 4.0,
        "span": 100.0,
    },
}
NOISE = {
    "kind": "degraded",
    "position_noise": [0.02, 0.02, 0.02, 0.01, 0.01, 0.01],
    "velocity_noise": [0.02, 0.02, 0.02, 0.005, 0.005, 0.005],
}
SCENARIO = {
    "controller": {"kind": "pid", "frequency": 1.5},
    "reference": {
        "kind": "lissajous",
        "amplitude": [1.0, 1.0, 0.5, 1.0],
        "frequency": [0.4, 0.5, 0.6, 0.4],
        "depth": 5.0,
    },
    "initial": {"position": [0, 0, 5, 0, 0, 0]},
    "loop": {"duration": 60.0, "dt": 0.02, "record": 0.02},
}


def vehicle(**changes):
    """The section `plant` with some numbers of the vehicle changed."""
    return {"vehicle": {"kind": "bluerov2_heavy", **changes}, "thruster": {"kind": "t200", "supply": 16}}


def main() -> None:
    """Print a table for each disturbance."""
    options = argparse.ArgumentParser()
    options.add_argument("--seeds", type=int, default=6)
    arguments = options.parse_args()
    ut.prepare()
    drag = [TRUTH["quadratic_damping.surge"], TRUTH["quadratic_damping.sway"], TRUTH["quadratic_damping.heave"]]
    for name, disturbance in DISTURBANCES.items():
        rows = {method: [] for method in METHODS}
        for seed in range(arguments.seeds):
            real = SCENARIO | {
                "plant": vehicle(quadratic_damping=np.diag([*drag, 1.19, 0.47, 1.5]).tolist()),
                "model": {"vehicle": "bluerov2_heavy"},
                "disturbance": disturbance,
                "navigation": NOISE,
                "seed": seed,
            }
            log = ut.simulate_scenario(real).log()
            for method in METHODS:
                model = ut.identify({"plant": vehicle()}, log, free=FREE, method=method)
                rows[method].append([model.parameters[parameter] for parameter in FREE])
        print(f"\n{name}, {arguments.seeds} dives of a minute")
        for method, intervals in rows.items():
            _print(method, intervals)


def _print(method: str, rows) -> None:
    for i, name in enumerate(FREE):
        column = [row[i] for row in rows]
        truth = TRUTH.get(name, column[0].parameter.prior)
        errors = np.array([interval.value - truth for interval in column])
        inside = sum(interval.low <= truth <= interval.high for interval in column)
        stated = np.mean([interval.deviation for interval in column])
        rms = float(np.sqrt((errors**2).mean()))
        print(f"  {method:18}{name:28}{rms:10.3g}{stated:10.3g}   {inside} of {len(column)}", flush=True)


if __name__ == "__main__":
    main()
