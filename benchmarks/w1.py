"""Workload W1 in numbers: python benchmarks/w1.py [--numpy]

Prints JSON: microseconds per tick of one compiled trial (minimum and median of many), the time of one controller
step from Python, the time to the first result, and with --numpy the plain-NumPy yardstick and the ratio to it.
"""

import json
import sys
import time

START = time.perf_counter()  # before the imports: they are part of the first run

import jax
import numpy as np

from undertow.analysis.metrics import Metrics, results
from undertow.loop import sampled
from undertow.scenario.build import build
from undertow.studies.paper.setup import scenario

TICKS = 20_000


def main() -> dict:
    """Measure."""
    loop = build(scenario("W1", rung="electromechanical", composite=20.0, loop={"kind": "sampled"})).closed_loop
    window = (Metrics(10.0, 20.0),)

    def trial():
        return jax.block_until_ready(sampled.simulate(loop, duration=TICKS * 1e-3, record_every=0, accumulators=window))

    outcome = trial()
    found = {"first_run_s": time.perf_counter() - START}
    times = np.sort([_timed(trial) for _ in range(25)]) / TICKS * 1e6
    found["single_us_per_tick"] = times[0]
    found["single_us_per_tick_median"] = times[len(times) // 2]
    found["tracking_rms"] = results(outcome.accumulated[0])["tracking_rms"]
    found |= _controller_step(loop)
    if "--numpy" in sys.argv:
        from plain_numpy import workload_w1

        ticks = TICKS // 10
        found["numpy_us_per_tick"] = _timed(lambda: workload_w1(ticks)) / ticks * 1e6
        found["times_faster_than_numpy"] = found["numpy_us_per_tick"] / found["single_us_per_tick"]
    return found


def _controller_step(loop) -> dict:
    """One `command` and `advance` from Python, compiled ahead, microseconds."""
    drawn = loop.draw(jax.random.PRNGKey(0))
    x, z = drawn.start()
    y, r = loop.plant.output(0.0, x), loop.reference.at(0.0)
    law = loop.controller
    command = jax.jit(lambda z, y, r: law.command(z, y, r))
    advance = jax.jit(lambda z, y, r, u, dt: law.advance(z, y, r, u, dt))

    def step(z):
        u, _ = command(z, y, r)
        return jax.block_until_ready(advance(z, y, r, u, 1e-3))

    z = step(z)
    times = np.sort([_timed(lambda: step(z)) for _ in range(3000)]) * 1e6
    return {"controller_step_us_p50": times[1500], "controller_step_us_p99": times[2970]}


def _timed(work) -> float:
    start = time.perf_counter()
    work()
    return time.perf_counter() - start


if __name__ == "__main__":
    print(json.dumps({key: round(float(value), 6) for key, value in main().items()}, indent=1))
