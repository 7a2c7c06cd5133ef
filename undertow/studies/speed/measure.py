"""Times of workload W1, taken one after another on one machine, so that their ratios mean something."""

import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np

from undertow.core import runtime
from undertow.lanes import nvidia
from undertow.lanes.cuda import Driver
from undertow.lanes.machine import lanes_of
from undertow.loop import sampled
from undertow.loop.in_lanes import Run
from undertow.loop.vmapped import Fleet as Vmapped
from undertow.studies.speed import plain_numpy, workload
from undertow.studies.speed.workload import TICKS

# Runs of a batch, and how often everything is done; the shortest time counts.
_BATCH = 64
_REPETITIONS = 7
_ON_GPU = 65_536
# Ticks of the yardstick, which is slow.
_NUMPY_TICKS = 2_000

Watch = Callable[[str, float], None]


def measure(watch: Watch) -> dict[str, Any]:
    """Nanoseconds per tick, and per run where several fly at once; seconds of compiling.

    Args:
        watch: told what is being done, and the share done.
    """
    threads = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
    found: dict[str, Any] = {"ticks": TICKS, "threads": threads, "lanes": lanes_of(64)}
    watch("first results", 0.0)
    found["first_cold_s"], found["first_kept_s"] = _first_results()
    with runtime.on_processor():
        watch("one run, in lanes", 0.1)
        run = workload.one()
        found |= _in_a_lane(run)
        watch("one run, by XLA", 0.2)
        found |= _by_xla(run)
    for i, kind in enumerate(("float64", "float32")):
        watch(f"many runs, {kind}", 0.4 + 0.2 * i)
        with runtime.in_precision(kind):
            found |= _many(kind, threads)
    watch("plain NumPy", 0.8)
    found["numpy_ns"] = _shortest(lambda: plain_numpy.workload_w1(_NUMPY_TICKS), 1) / _NUMPY_TICKS
    found["single_times_numpy"] = found["numpy_ns"] / found["single_ns"]
    found["batch_times_scalar"] = found["single_ns"] / found["batch_float64_ns"]
    watch("", 1.0)
    return found


def _first_results() -> tuple[float, float]:
    """Seconds from the start of a process to its first result: without compiled code from before, and with it."""
    with tempfile.TemporaryDirectory() as folder:
        settings = {**os.environ, "UNDERTOW_CACHE": folder}
        settings.pop("JAX_COMPILATION_CACHE_DIR", None)
        command = [sys.executable, "-W", "ignore", "-m", "undertow.studies.speed.first"]
        work = lambda: subprocess.run(command, env=settings, check=True, capture_output=True)
        return _timed(work)[1], _timed(work)[1]


def _in_a_lane(run: Run) -> dict[str, float]:
    single, compiling = _timed(lambda: workload.fleet(run, lanes=1))
    numbers = workload.alone(run)
    tracking = float(workload.tracking(single.fly(numbers).accumulated)[0])
    each = _shortest(lambda: single.fly(numbers)) / TICKS
    return {"single_compile_s": compiling, "single_ns": each, "tracking_rms": tracking}


def _by_xla(run: Run) -> dict[str, float]:
    def fly():
        at = dict(zip(("position", "velocity"), run.start, strict=True))
        return jax.block_until_ready(
            sampled.simulate(run.loop, duration=TICKS * 1e-3, record_every=0, accumulators=run.accumulators, **at)
        )

    _, first = _timed(fly)
    shortest = _shortest(fly)
    return {"single_xla_compile_s": first - shortest * 1e-9, "single_xla_ns": shortest / TICKS}


def _many(kind: str, threads: int) -> dict[str, Any]:
    """Many runs, on this machine's processor and on its GPU if it has one."""
    with runtime.on_processor():
        run = workload.one(kind)
        found = {f"batch_{kind}_{key}": value for key, value in _batch(run, threads).items()}
    if jax.default_backend() == "gpu":
        found |= {"gpu": jax.devices()[0].device_kind, f"gpu_{kind}_vmap_ns": vmapped_ns(run, _ON_GPU, ticks=200)}
    driver = nvidia.gpu()
    if driver is not None:
        by_threads = on_gpu(run, driver, _ON_GPU, TICKS)
        found |= {f"gpu_{kind}_{key}": value for key, value in by_threads.items()}
    return found


def _batch(run: Run, threads: int) -> dict[str, float]:
    """Several runs per thread, all threads at once and one alone."""
    program, compiling = _timed(lambda: workload.fleet(run))
    numbers = workload.several(run, _BATCH)

    def together(count: int) -> float:
        with runtime.workers(count) as pool:
            return _shortest(lambda: list(pool.map(lambda _: program.fly(numbers), range(count)))) / count

    each = TICKS * _BATCH
    return {"compile_s": compiling, "one_thread_ns": together(1) / each, "ns": together(threads) / each}


def on_gpu(run: Run, driver: Driver, runs: int, ticks: int) -> dict[str, float]:
    """Many runs on a GPU, a thread each; copying to and fro is counted."""
    program, compiling = _timed(lambda: workload.fleet(run, ticks=ticks, driver=driver))
    numbers = workload.several(run, runs)
    each = _shortest(lambda: program.fly(numbers), 3) / (ticks * runs)
    return {"compile_s": compiling, "ns": each, "ticks_per_second": 1e9 / each}


def vmapped_ns(run: Run, runs: int, ticks: int) -> float:
    """Nanoseconds per tick and run by `jax.vmap` on the device that JAX uses."""
    program = Vmapped(run, workload.PLAN._replace(ticks=ticks), width=runs)
    numbers = jax.tree.map(jnp.asarray, workload.several(run, runs))
    return _shortest(lambda: program.fly(numbers), 3) / (ticks * runs)


def _timed(work: Callable[[], Any]) -> tuple[Any, float]:
    start = time.perf_counter()
    return work(), time.perf_counter() - start


def _shortest(work: Callable[[], Any], repetitions: int = _REPETITIONS) -> float:
    """Nanoseconds."""
    work()
    return float(np.min([_timed(work)[1] for _ in range(repetitions)])) * 1e9
