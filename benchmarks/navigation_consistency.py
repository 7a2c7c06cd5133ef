"""Navigation filter with states for correlated errors of its sensors, and without: NEES, and its monitor.

BlueROV2 Heavy at sea (examples/bluerov2_heavy.yaml) with the filter `kalman`, 120 s; figures are of the second half.

    python benchmarks/navigation_consistency.py [--seeds 4] [--cases "white noise,soft iron 0.05 rad"] [--moving]

A filter that is as accurate as it says has NEES 9. `--moving` lets the vehicle move and turn instead of keeping its
station. "contradicted" counts the runs whose innovations the monitor found inconsistent, and names the sensors. Two
minutes a case with four seeds on two cores.
"""

import argparse
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import yaml

import undertow as ut

SCENARIO = Path(__file__).parents[1] / "examples/bluerov2_heavy.yaml"
MOVING = {"kind": "lissajous", "amplitude": [2.0, 1.0, 0.5, 0.8], "frequency": [0.2, 0.4, 0.3, 0.25]}  # m, rad; rad/s
CASES: dict[str, dict[str, dict[str, float]]] = {
    "white noise": {},
    "DVL correlated over 2 s": {"dvl": {"correlated_noise": 0.01, "correlation_time": 2}},  # m/s
    "soft iron 0.05 rad": {"compass": {"soft_iron": 0.05}},
    "hard iron 0.05 rad": {"compass": {"hard_iron": 0.05}},
    "thruster currents": {"compass": {"interference": 0.002, "assumed_current": 20}},  # rad/A, A
    "currents, speeds known": {"compass": {"interference": 0.002}, "propeller_speed": {}},
    "tilt correlated over 5 s": {"imu": {"correlated_angle_noise": 0.01, "correlation_time": 5}},  # rad
    "depth correlated over 60 s": {"depth": {"correlated_noise": 0.02, "correlation_time": 60}},  # m
    "fixes correlated over 20 s": {"position_fix": {"correlated_noise": 0.3, "correlation_time": 20}},  # m
    "compass, bias 0.05 rad": {"compass": {"bias": 0.05}},  # which the filter takes for white noise
    "compass, constant 0.05 rad": {"compass": {"correlated_noise": 0.05, "correlation_time": 1e6}},
}


class Figures(NamedTuple):
    """Of some runs of one case."""

    nees: list[float]
    yaw_error: float  # rad rms
    yaw_deviation: float  # rad, as the filter says
    contradicted: int  # runs
    sensors: list[str]


def scenario_of(errors: dict[str, dict[str, float]], known: bool, seed: int, moving: bool) -> dict[str, Any]:
    """Scenario of one run, with errors of sensors by their kind."""
    scenario = yaml.safe_load(SCENARIO.read_text())
    sensors = [{"kind": one} if isinstance(one, str) else one for one in scenario["navigation"]["sensors"]]
    added = [{"kind": kind} for kind in errors if kind not in {one["kind"] for one in sensors}]
    sensors = [one | errors.get(one["kind"], {}) for one in [*sensors, *added]]
    scenario["navigation"] = {"kind": "kalman", "sensors": sensors, "sensor_error_states": known}
    if moving:
        scenario["reference"] = MOVING
    return scenario | {"seed": seed}


def figures(errors: dict[str, dict[str, float]], known: bool, seeds: int, moving: bool) -> Figures:
    """Figures of runs with different seeds."""
    nees, yaw_errors, yaw_deviations, contradicted, sensors = [], [], [], 0, []
    for seed in range(seeds):
        result = ut.simulate_scenario(scenario_of(errors, known, seed, moving)).result
        run, navigated = result.series, result.facts.navigation
        assert navigated is not None
        nees.append(navigated["nees"])
        late = run["time"].values >= run["time"].values[-1] / 2
        yaw_errors.append((run["measured_position"] - run["position"]).values[late, 5])
        yaw_deviations.append(run["navigation_deviation"].values[late, 5])
        found = [one["sensor"] for one in navigated["sensors"] if one["inconsistent"] > 0]
        contradicted += bool(found)
        sensors += found
    rms = lambda values: float(np.sqrt(np.square(values).mean()))
    return Figures(nees, rms(yaw_errors), rms(yaw_deviations), contradicted, list(dict.fromkeys(sensors)))


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seeds", type=int, default=4)
    parser.add_argument("--cases", default="", help="names, with commas between; all without")
    parser.add_argument("--moving", action="store_true")
    options = parser.parse_args()
    chosen = [name for name in CASES if not options.cases or name in options.cases]
    print(
        f"{'case':26} {'filter':8} {'NEES':>8} {'smallest':>8} {'largest':>8} {'yaw mrad':>8} {'says':>6} contradicted"
    )
    for name in chosen:
        for known in (False, True):
            found = figures(CASES[name], known, options.seeds, options.moving)
            numbers = (np.mean(found.nees), min(found.nees), max(found.nees), 1e3 * found.yaw_error)
            by = f" ({', '.join(found.sensors)})" if found.sensors else ""
            print(
                f"{name:26} {'models' if known else 'neglects':8} {' '.join(f'{value:8.1f}' for value in numbers)} "
                f"{1e3 * found.yaw_deviation:6.1f} {found.contradicted} of {options.seeds}{by}",
                flush=True,
            )


if __name__ == "__main__":
    main()
