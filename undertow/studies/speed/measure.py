"""Times of workloads W1 and W2, measured one after another on one machine, so that their ratios are meaningful."""

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
from undertow.core.batch_compiler import unavailable
from undertow.simulation.loop import sampled, simd_batch
from undertow.simulation.loop.vmap_batch import XlaBatchRunner
from undertow.studies.speed import plain_numpy, workload
from undertow.studies.speed.workload import W1, W2, Workload

# Runs of a batch, and number of repetitions; the shortest time counts.
_BATCH, _BATCH_W2 = 64, 16
_REPETITIONS, _REPETITIONS_W2 = 7, 3
_ON_GPU = 65_536
# Control steps of the NumPy comparison, which is slow.
_NUMPY_STEPS = 2_000

Watch = Callable[[str, float], None]  # called with the current stage and the share done


def measure(watch: Watch) -> dict[str, Any]:
    """Nanoseconds per step, and per run where several execute at once; seconds of compiling; operations of one step.

    Returns:
        Figures of W1 by their names, those of W2 under names that begin with `w2_`.
    """
    threads = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
    figures: dict[str, Any] = {"threads": threads, "simd_width": simd_batch.simd_width(64)}
    why_no_simd = unavailable()
    if why_no_simd:
        figures["simd_unavailable"] = why_no_simd
    watch("first results", 0.0)
    figures["first_cold_s"], figures["first_kept_s"] = _first_results()
    with runtime.on_processor():
        watch("W1, one run", 0.1)
        w1 = workload.workload(W1)
        figures |= {"steps": w1.steps} | ({} if why_no_simd else _single(w1))
        watch("W1, one run, XLA backend", 0.2)
        figures |= _by_xla(w1)
        if not why_no_simd:
            watch("W2, one run", 0.3)
            w2 = workload.workload(W2)
            second = {"steps": w2.steps} | _single(w2, _REPETITIONS_W2)
            second |= _prefixed("batch_float64_", _batch(w2, threads, _BATCH_W2, _REPETITIONS_W2))
            figures |= _prefixed("w2_", second)
    for i, kind in enumerate(() if why_no_simd else ("float64", "float32")):
        watch(f"W1, batch, {kind}", 0.5 + 0.2 * i)
        with runtime.in_precision(kind):
            figures |= _many(kind, threads)
    watch("W1 in plain NumPy", 0.9)
    figures["numpy_ns"] = _shortest(lambda: plain_numpy.workload_w1(_NUMPY_STEPS), 1) / _NUMPY_STEPS
    if not why_no_simd:
        figures["single_times_numpy"] = figures["numpy_ns"] / figures["single_ns"]
        figures["batch_times_scalar"] = figures["single_ns"] / figures["batch_float64_ns"]
    watch("", 1.0)
    return figures


def _first_results() -> tuple[float, float]:
    """Seconds from the start of a process to its first result, without and with cached compiled code."""
    with tempfile.TemporaryDirectory() as folder:
        settings = with_cache(folder)
        command = [sys.executable, "-W", "ignore", "-m", "undertow.studies.speed.first"]
        work = lambda: subprocess.run(command, env=settings, check=True, capture_output=True)
        return _timed(work)[1], _timed(work)[1]


def with_cache(folder: str) -> dict[str, str]:
    """Environment of a process that keeps all compiled code in a folder, and finds none elsewhere."""
    settings = {**os.environ, "UNDERTOW_CACHE": folder}
    settings.pop("JAX_COMPILATION_CACHE_DIR", None)
    return settings


def _single(job: Workload, repetitions: int = _REPETITIONS) -> dict[str, float]:
    single, compiling = _timed(lambda: workload.batch(job, width=1))
    numbers = workload.batch_of_one(job.run)
    tracking = float(workload.tracking(single.run(numbers).accumulated)[0])
    ns_per_step = _shortest(lambda: single.run(numbers), repetitions) / job.steps
    return {"single_compile_s": compiling, "single_ns": ns_per_step, "tracking_rms": tracking}


def _by_xla(job: Workload) -> dict[str, float]:
    run, plan = job

    def execute():
        at = dict(zip(("position", "velocity"), run.start, strict=True))
        return jax.block_until_ready(
            sampled.simulate(
                run.loop, duration=plan.steps * plan.dt, dt=plan.dt, record_every=0, accumulators=run.accumulators, **at
            )
        )

    _, first = _timed(execute)
    shortest = _shortest(execute)
    return {"single_xla_compile_s": first - shortest * 1e-9, "single_xla_ns": shortest / plan.steps}


def _many(kind: str, threads: int) -> dict[str, Any]:
    """A batch, on the CPU and, if there is one, on the GPU."""
    with runtime.on_processor():
        job = workload.workload(W1 | {"precision": kind})
        figures = _prefixed(f"batch_{kind}_", _batch(job, threads, _BATCH))
    if jax.default_backend() == "gpu":
        short = job._replace(plan=job.plan._replace(steps=200))
        figures |= {"gpu": jax.devices()[0].device_kind, f"gpu_{kind}_vmap_ns": vmapped_ns(short, _ON_GPU)}
    driver = simd_batch.gpu()
    if driver is not None:
        figures |= _prefixed(f"gpu_{kind}_", on_gpu(job, driver, _ON_GPU))
    return figures


def _batch(job: Workload, threads: int, runs: int, repetitions: int = _REPETITIONS) -> dict[str, float]:
    """Several runs per thread, all threads at once and one alone."""
    program, compiling = _timed(lambda: workload.batch(job))
    numbers = workload.several(job.run, runs)

    def together(count: int) -> float:
        with runtime.workers(count) as pool:
            work = lambda: list(pool.map(lambda _: program.run(numbers), range(count)))
            return _shortest(work, repetitions) / count

    steps = job.steps * runs
    figures = {"compile_s": compiling, "one_thread_ns": together(1) / steps, "ns": together(threads) / steps}
    # The program of a single run has its stages in a loop, which counts them once.
    return figures | {"operations": program.operations}


def on_gpu(job: Workload, driver: Any, runs: int) -> dict[str, float]:
    """A batch on a GPU with one thread per run, including the copies to and from it."""
    program, compiling = _timed(lambda: workload.batch(job, driver=driver))
    numbers = workload.several(job.run, runs)
    ns_per_step = _shortest(lambda: program.run(numbers), 3) / (job.steps * runs)
    return {"compile_s": compiling, "ns": ns_per_step, "steps_per_second": 1e9 / ns_per_step}


def vmapped_ns(job: Workload, runs: int) -> float:
    """Nanoseconds per step and run by `jax.vmap` on the device that JAX uses."""
    program = XlaBatchRunner(job.run, job.plan, width=runs)
    numbers = jax.tree.map(jnp.asarray, workload.several(job.run, runs))
    return _shortest(lambda: program.run(numbers), 3) / (job.steps * runs)


def _prefixed(prefix: str, figures: dict[str, Any]) -> dict[str, Any]:
    return {f"{prefix}{key}": value for key, value in figures.items()}


def _timed(work: Callable[[], Any]) -> tuple[Any, float]:
    start = time.perf_counter()
    return work(), time.perf_counter() - start


def _shortest(work: Callable[[], Any], repetitions: int = _REPETITIONS) -> float:
    """Nanoseconds."""
    work()
    return float(np.min([_timed(work)[1] for _ in range(repetitions)])) * 1e9
