"""Time from an odometry message to the answer, between two processes: python benchmarks/ros2_round_trips.py [--json]

The other process is CycloneDDS in Python that answers at once, Fast DDS in C++ that does (it needs fastddsgen,
libfastrtps-dev and g++, and is left out without), or `undertow ros2` with the controller of
examples/bluerov2_heavy.yaml.
Loopback only. A message without an answer within a second is lost.
"""

import argparse
import contextlib
import json
import shutil
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from undertow.outside.ros2 import messages as ros
from undertow.outside.ros2.from_messages import SECOND, Frames, PoseAndVelocity
from undertow.outside.ros2.link import Inlet, Link, Outlet
from undertow.outside.ros2.to_messages import odometry_of, stamp_of

ROOT = Path(__file__).parents[1]
sys.path.insert(0, str(ROOT / "tests/ros2"))

import fast_dds

DOMAIN, LOST, MATCHED = 77, 1.0, 60.0  # s; the controller compiles first
STILL = PoseAndVelocity(np.zeros(3), np.array([1.0, 0, 0, 0]), np.zeros(6))


def echo() -> None:
    """Answer each odometry with eight numbers, until standard input ends."""
    ended = threading.Event()
    threading.Thread(target=lambda: (sys.stdin.read(), ended.set()), daemon=True).start()
    with Link(DOMAIN, True) as link:
        odometry = link.subscriber("/odom", ros.Odometry)
        thrusters = link.publisher("/thrusters", ros.Float64MultiArray)
        while not ended.is_set():
            link.wait(0.1)
            for _ in odometry.take():
                thrusters.publish(ros.Float64MultiArray(data=[0.0] * 8))


def measured(count: int) -> dict[str, float]:
    """Round trips with whoever answers."""
    with Link(DOMAIN, True) as link:
        out: Outlet = link.publisher("/odom", ros.Odometry)
        back: Inlet = link.subscriber("/thrusters", ros.Float64MultiArray)
        until = time.monotonic() + MATCHED
        while not (out.subscribers() and back.publishers()):
            if time.monotonic() > until:
                raise TimeoutError("nobody answers")
            time.sleep(0.01)
        times = [_trip(link, out, back, 0.01 * k) for k in range(count + 100)][100:]  # the first ones warm up
    answered = 1e6 * np.array([one for one in times if one is not None])
    found = {"messages": count, "lost": times.count(None), "median_us": float(np.median(answered))}
    return found | {"p99_us": float(np.quantile(answered, 0.99)), "most_us": float(answered.max())}


def _trip(link: Link, out: Outlet, back: Inlet, seconds: float) -> float | None:
    """Time (s) of one round trip; None where no answer came."""
    message = odometry_of(STILL, stamp_of(round(seconds * SECOND)), Frames())
    began = time.perf_counter()
    out.publish(message)
    while time.perf_counter() - began < LOST:
        if link.wait(0.1) and back.take():
            return time.perf_counter() - began
    return None


@contextlib.contextmanager
def process(*command: str) -> Iterator[None]:
    """Another process, ended with the context."""
    with subprocess.Popen([sys.executable, *command], stdin=subprocess.PIPE, stdout=subprocess.DEVNULL) as one:
        try:
            yield
        finally:
            one.terminate()


def main() -> None:
    options = argparse.ArgumentParser(description=__doc__)
    options.add_argument("--json", action="store_true", help="print JSON instead of a table")
    options.add_argument("--count", type=int, default=2000, help="messages")
    options.add_argument("--echo", action="store_true", help="be the other process")
    given = options.parse_args()
    if given.echo:
        echo()
        return
    found = {}
    with process(__file__, "--echo"):
        found["CycloneDDS, Python"] = measured(given.count)
    if shutil.which("fastddsgen") and shutil.which("g++"):
        with tempfile.TemporaryDirectory() as folder, fast_dds.running(fast_dds.build(Path(folder)), DOMAIN, "echo"):
            found["Fast DDS, C++"] = measured(given.count)
    scenario = str(ROOT / "examples/bluerov2_heavy.yaml")
    node = ("-m", "undertow", "ros2", scenario, "--use-sim-time", "--localhost", "--domain", str(DOMAIN))
    with process(*node):
        found["undertow ros2"] = measured(given.count)
    if given.json:
        print(json.dumps(found, indent=2))
        return
    print(f"{'who answers':<20}{'messages':>10}{'lost':>6}{'median':>10}{'99 %':>10}{'most':>10}")
    for name, one in found.items():
        times = "".join(f"{one[key]:>7.0f} us" for key in ("median_us", "p99_us", "most_us"))
        print(f"{name:<20}{one['messages']:>10}{one['lost']:>6}{times}")


if __name__ == "__main__":
    main()
