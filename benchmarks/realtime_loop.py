"""Jitter, computing time and overruns of the real-time loop on this machine, idle and with busy processes beside it.

BlueROV2 Heavy with eight T200s under preset `robust` at 100 Hz, with the scenario's vehicle in the same process and a
log of every step, by the monotonic clock:

    python benchmarks/realtime_loop.py [--seconds 120] [--busy 2] [--priority 50] [--json]

`busy` processes compute all the time in the second run; with `--priority` both runs are repeated with SCHED_FIFO.
"""

import argparse
import contextlib
import json
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any

SCENARIO = {
    "plant": {"vehicle": "bluerov2_heavy", "thruster": {"kind": "t200", "supply": 16}},
    "controller": {"kind": "rcaf", "preset": "robust"},
    "reference": {"kind": "setpoint", "position": [2, 1, 1, 0, 0, 0.5], "settling": 20},
    "disturbance": {"kind": "current", "velocity": [0.3, 0.2, 0]},
    "navigation": {"kind": "white_noise", "position": 0.001, "velocity": 0.01},
    "loop": {"dt": 0.01, "duration": 10.0},
}
SHARES = ("p50", "p99", "p99.9", "max")


@contextlib.contextmanager
def busy(processes: int) -> Iterator[None]:
    """Processes that compute until the block ends."""
    started = [subprocess.Popen([sys.executable, "-c", "while True: pass"]) for _ in range(processes)]
    try:
        yield
    finally:
        for process in started:
            process.kill()
            process.wait()


def measured(seconds: float, priority: int | None) -> dict[str, Any]:
    """Statistics of one run."""
    import undertow as ut
    from undertow.outside.realtime.control_loop import RealTimeLoop
    from undertow.outside.realtime.loop_clock import MonotonicClock
    from undertow.outside.realtime.process_priority import scheduled
    from undertow.outside.realtime.vehicle_link import VehicleLink
    from undertow.scenario.build import build
    from undertow.scenario.reading import from_data

    built = build(from_data(SCENARIO))
    with tempfile.TemporaryDirectory() as folder:
        log = Path(folder) / "run.mcap"
        autopilot = ut.Autopilot(built, attitude="both", velocity="both", log=log, log_later=True)
        loop = RealTimeLoop(autopilot, VehicleLink(built), MonotonicClock())
        with scheduled(priority, None):
            loop.run(round(seconds / built.scenario.loop.dt))
        autopilot.close_log()
    return loop.statistics.as_data()


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seconds", type=float, default=120.0)
    parser.add_argument("--busy", type=int, default=2)
    parser.add_argument("--priority", type=int)
    parser.add_argument("--json", action="store_true")
    given = parser.parse_args()
    found = {}
    for priority in dict.fromkeys((None, given.priority)):
        for processes in (0, given.busy):
            name = f"{processes} busy" + ("" if priority is None else f", priority {priority}")
            with busy(processes):
                found[name] = measured(given.seconds, priority)
    if given.json:
        print(json.dumps({"unit": "s", **found}, indent=2))
        return
    print(f"{'ms':<34}" + "".join(f"{share:>9}" for share in SHARES))
    for name, row in found.items():
        for what in ("computing", "lateness", "jitter"):
            print(f"{name:<22}{what:<12}" + "".join(f"{1e3 * row[what][share]:9.3f}" for share in SHARES))
        print(f"{name}: {row['overruns']} overruns, {row['missed']} missed periods in {row['steps']} steps")


if __name__ == "__main__":
    main()
