"""Simulated hours with noise, current and waves: nothing may grow, and the last hour must be as good as the first."""

import resource
import time
from collections.abc import Callable, Mapping
from typing import Any, NamedTuple

import numpy as np

from soak.judged_runs import Judged, judged_runs
from soak.verdict import Failure
from undertow.core.status import Status

# The longest run, h; more hours make more runs.
LONGEST = 24.0

_CHANGE = 0.05  # growth of the rms, between the first and the last hour
_GROWTH = 0.05  # of the largest weight, against that of all hours before

_SEA: list[dict[str, Any]] = [
    {"kind": "gauss_markov_current", "mean": [0.2, 0.1, 0.0]},
    {"kind": "waves", "height": 0.5, "period": 5},
]
_HOLD = {"kind": "setpoint", "position": [2.0, 1.0, 1.0, 0.0, 0.0, 0.5], "settling": 20}
_SENSORS = ["imu", {"kind": "dvl", "period": 0.125, "noise": 0.005, "delay": 0.05}, "depth", "compass"]
_SENSORS += [{"kind": "position_fix", "period": 1, "noise": 0.05, "delay": 0.2}]

SCENARIOS: dict[str, dict[str, Any]] = {
    "BlueROV2 Heavy, robust law, observer": {
        "plant": {"vehicle": "bluerov2_heavy", "thruster": {"kind": "t200", "supply": 16}},
        "model": {"rate_term": True},
        "controller": {"kind": "rcaf", "preset": "robust"},
        "navigation": {"kind": "observer", "sensors": _SENSORS},
    },
    "ODIN, robust law, noise of 1 cm/s": {
        "plant": {"vehicle": "odin", "thruster": {"kind": "paper_table3", "fidelity": "static", "supply": 24}},
        "controller": {"kind": "rcaf", "preset": "robust"},
        "navigation": {"kind": "white_noise", "position": 0.005, "velocity": 0.01},
    },
    "RexROV, PID, noise of 1 cm/s": {
        "plant": {"vehicle": "rexrov"},
        "controller": {"kind": "pid"},
        "navigation": {"kind": "white_noise", "position": 0.005, "velocity": 0.01},
    },
    "BlueROV2 Heavy, ADRC, Kalman filter": {
        "plant": {"vehicle": "bluerov2_heavy", "thruster": {"kind": "t200", "supply": 16}},
        "controller": {"kind": "adrc"},
        "navigation": {"kind": "kalman", "sensors": _SENSORS},
    },
}


class Hours(NamedTuple):
    """Result of simulated hours.

    Attributes:
        hours: vehicle-hours that were simulated.
        rows: of a table: name of the loop, runs, hours of each, rms of the position in the first and the last hour (m),
            largest weight in both (m/s^2), the completed runs, and the alarms of the supervisor, all of them false.
        failures: never-events, and what grew.
        memory: MB of the process before and after, at their largest.
        seconds: elapsed time.
    """

    hours: float
    rows: list[dict[str, Any]]
    failures: list[Failure]
    memory: tuple[float, float]
    seconds: float


def scenario(name: str, hours: float, seed: int) -> dict[str, Any]:
    """A long run of the loop of a name, with another realization for every seed."""
    loop = {"kind": "sampled", "dt": 0.01, "duration": 3600.0 * hours, "record": 1.0}
    return SCENARIOS[name] | {"supervisor": True, "reference": _HOLD, "disturbance": _SEA, "loop": loop, "seed": seed}


def simulate_hours(
    hours: float, seed: int, until: float = float("inf"), watch: Callable[[float], None] = lambda done: None
) -> Hours:
    """Simulate so many vehicle-hours, the same number of runs of every loop.

    Args:
        hours: of all runs together; a run lasts a day, or less where fewer hours are asked for.
        seed: of all of them.
        until: time of `time.monotonic` after which no further loop begins.
        watch: called with the hours that are done.
    """
    began = time.monotonic()
    rows = []
    failures = []
    done = 0.0
    hours_of_each_loop = hours / len(SCENARIOS)
    longest = min(LONGEST, hours_of_each_loop)
    number = max(1, round(hours_of_each_loop / longest))
    before = _memory()
    for name in SCENARIOS:
        if time.monotonic() > until:
            break
        scenarios = [scenario(name, longest, seed + i) for i in range(number)]
        windows = max(2, round(longest))
        judged = judged_runs(scenarios, windows)
        rows.append(_row(name, judged, longest))
        for i, run in enumerate(judged):
            identity = f"hours/{list(SCENARIOS).index(name)}/{longest:g}/{seed + i}"
            failures += judged_run(run, identity, longest >= LONGEST)
        done += number * longest
        watch(done)
    return Hours(done, rows, failures, (before, _memory()), time.monotonic() - began)


def judged_run(run: Judged, identity: str, whole_day: bool) -> list[Failure]:
    """Never-events of a long run; that it failed, and for a whole day that something grew, are failures as well."""
    failures = [Failure(event, identity, message) for event, message in run.events()]
    if run.status is not Status.OK:
        failures.append(Failure("N3", identity, f"ended at {run.ended:.0f} s: {run.status.sentence}"))
    elif whole_day:
        rms = run.rms()
        weights = run.counts.weights
        first, last = _size(rms[0]), _size(rms[-1])
        if last / first - 1 > _CHANGE:  # less than at first is the weather
            failures.append(Failure("N4", identity, f"rms of the last hour {last:.4g} m, of the first {first:.4g} m"))
        if weights[-1] > (1 + _GROWTH) * weights[:-1].max():
            failures.append(Failure("N4", identity, f"weights grew to {weights[-1]:.3g} from {weights[:-1].max():.3g}"))
    return failures


def replay(identity: str) -> Judged:
    """The run of an identity once more: `hours/LOOP/HOURS/SEED`."""
    _, index, hours, seed = identity.split("/")
    name = list(SCENARIOS)[int(index)]
    return judged_runs([scenario(name, float(hours), int(seed))], max(2, round(float(hours))))[0]


def _size(rms: np.ndarray) -> float:
    """Rms of the position, m: the first three axes are metres."""
    return float(np.sqrt((rms[:3] ** 2).sum()))


def _row(name: str, runs: list[Judged], hours: float) -> dict[str, Any]:
    sizes = [(_size(run.rms()[0]), _size(run.rms()[-1])) for run in runs]
    weights = [(run.counts.weights[0], run.counts.weights[-1]) for run in runs]
    mean = lambda values, index: float(np.mean([pair[index] for pair in values]))
    row: Mapping[str, Any] = {
        "loop": name,
        "runs": len(runs),
        "hours": hours,
        "completed": sum(run.status is Status.OK for run in runs),
        "alarms": sum(run.alarms for run in runs),
        "first_rms": mean(sizes, 0),
        "last_rms": mean(sizes, 1),
        "largest_change": float(max(abs(last / first - 1) for first, last in sizes)),
        "first_weights": mean(weights, 0),
        "last_weights": mean(weights, 1),
        "backend": runs[0].backend,
    }
    return dict(row)


def _memory() -> float:
    """Largest resident memory of this process so far, MB."""
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1e3
