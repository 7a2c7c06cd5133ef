"""Latency of one step: the controller, the same under supervision, and the navigation filter by itself.

BlueROV2 Heavy with eight T200s under preset `robust`, and the Kalman filter of the vehicle's own sensors. A step
includes everything that a caller waits for: checks of the numbers given, the law, the output in volts.

    python benchmarks/autopilot_latency.py [--steps 50000] [--json]

`gated` is the controller with a supervisor that does not watch the thrusters, `supervised` with one that does. Readings
are those of a vehicle that moves by millimetres, as the supervisor takes nothing else for one.

`wall` is the time that passes, `processor` that in which the step computes: they differ where other processes take the
processor away (`preempted`), which on a busy machine makes the longest steps.
`compile_cold` starts with an empty folder of compiled code, `compile_kept` with what the first one left there; both
include the import of undertow and of JAX.
"""

import argparse
import gc
import json
import os
import resource
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from typing import Any

import numpy as np

DT = 0.01  # s
SCENARIO = {
    "plant": {"vehicle": "bluerov2_heavy", "thruster": {"kind": "t200", "supply": 16}},
    "controller": {"kind": "rcaf", "preset": "robust"},
    "reference": {"kind": "setpoint", "position": [2, 1, 1, 0, 0, 0.5]},
    "navigation": {"kind": "kalman"},
    "loop": {"dt": DT, "duration": 1.0},
}
SHARES = {"p50": 50.0, "p99": 99.0, "p99.9": 99.9, "max": 100.0}
BARS = {"p50": 50.0, "p99.9": 500.0}  # us, of a step of the controller


def controller(supervisor: Any = False) -> Callable[[int], object]:
    """A step of the controller, compiled and started."""
    import undertow as ut

    autopilot, chance = ut.Autopilot(SCENARIO | {"supervisor": supervisor}), np.random.default_rng(0)
    phase = 0.4 * np.pi * DT * np.arange(500)[:, None] + np.arange(6.0)  # a period of 5 s
    outputs, rates = 0.003 * np.sin(phase), 0.003 * 0.4 * np.pi * np.cos(phase)
    outputs, rates = (motion + 1e-4 * chance.normal(size=motion.shape) for motion in (outputs, rates))
    target = np.zeros(6)
    autopilot.start(outputs[0, :3], rates[0], outputs[0, 3:], target=target)
    return lambda k: autopilot.step(outputs[k % 500, :3], rates[k % 500], outputs[k % 500, 3:], target=target)


def gated() -> Callable[[int], object]:
    """A step of the controller with a supervisor that does not watch the thrusters."""
    return controller({"thruster_faults": False})


def supervised() -> Callable[[int], object]:
    """A step of the controller with a supervisor."""
    return controller(True)


def navigation() -> Callable[[int], object]:
    """A step of the navigation filter with a reading of every sensor every tenth time, and of the IMU always."""
    import undertow as ut

    navigation = ut.NavigationFilter(SCENARIO)
    navigation.start(np.zeros(3), np.zeros(6), np.zeros(3))
    usual = {name: np.zeros(size) for name, size in navigation.sensors.items()}
    usual["imu"][2] = -9.81  # specific force at rest, m/s^2
    alone = {"imu": usual["imu"]}
    return lambda k: navigation.step(alone if k % 10 else usual)


STEPS = {"controller": controller, "gated": gated, "supervised": supervised, "navigation": navigation}


def latency(name: str, steps: int) -> dict[str, Any]:
    """Percentiles of the time of one step, us, and the seconds of making it."""
    begun = time.perf_counter()
    step = STEPS[name]()
    made = time.perf_counter() - begun
    for k in range(1000):
        step(k)
    gc.collect()
    wall, processor = np.empty(steps), np.empty(steps)
    switched = resource.getrusage(resource.RUSAGE_SELF).ru_nivcsw
    for k in range(steps):
        used, before = time.thread_time_ns(), time.perf_counter_ns()
        step(k)
        wall[k], processor[k] = time.perf_counter_ns() - before, time.thread_time_ns() - used
    switched = resource.getrusage(resource.RUSAGE_SELF).ru_nivcsw - switched
    shares = lambda times: {share: float(np.percentile(times, at)) / 1e3 for share, at in SHARES.items()}
    return {"wall": shares(wall), "processor": shares(processor), "preempted": switched, "seconds": made}


def in_new_process(name: str, steps: int, cache: str) -> dict[str, Any]:
    """`latency` in a process whose folder of compiled code is `cache`."""
    command = [sys.executable, __file__, "--only", name, "--steps", str(steps)]
    done = subprocess.run(command, env=os.environ | {"UNDERTOW_CACHE": cache}, capture_output=True, text=True)
    if done.returncode:
        raise RuntimeError(done.stderr)
    return json.loads(done.stdout)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--steps", type=int, default=50_000)
    parser.add_argument("--json", action="store_true")
    parser.add_argument("--only", choices=STEPS, help=argparse.SUPPRESS)
    given = parser.parse_args()
    if given.only:
        print(json.dumps(latency(given.only, given.steps)))
        return
    found = {}
    for name in STEPS:
        with tempfile.TemporaryDirectory() as cache:
            cold = in_new_process(name, 1000, cache)["seconds"]
            kept = in_new_process(name, given.steps, cache)
        found[name] = kept | {"compile_cold": cold, "compile_kept": kept.pop("seconds")}
    if given.json:
        print(json.dumps({"unit": "us; compile in s", "bars": BARS, **found}, indent=2))
        return
    print(f"{'us':<24}" + "".join(f"{share:>9}" for share in SHARES))
    for name, row in found.items():
        for clock in ("wall", "processor"):
            print(f"{name:<12}{clock:<12}" + "".join(f"{row[clock][share]:9.1f}" for share in SHARES))
        seconds = f"compiled in {row['compile_cold']:.1f} s, with kept code in {row['compile_kept']:.1f} s"
        print(f"{name}: preempted {row['preempted']} times in {given.steps} steps; {seconds}")
    p50 = {name: row["wall"]["p50"] for name, row in found.items()}
    for name in ("gated", "supervised"):
        more = p50[name] - p50["controller"]
        alone, whole = more / p50["controller"], more / (p50["controller"] + p50["navigation"])
        print(
            f"{name}: {more:+.1f} us, {alone:+.0%} of the controller, {whole:+.0%} of controller and navigation filter"
        )
    for clock in ("wall", "processor"):
        met = all(found["controller"][clock][share] <= bar for share, bar in BARS.items())
        print(f"controller, p50 <= 50 us and p99.9 <= 500 us by the {clock} clock: {'met' if met else 'missed'}")


if __name__ == "__main__":
    main()
