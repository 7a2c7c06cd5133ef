"""Run a scenario: outcome, metrics and a dataset from which the run can be repeated."""

import errno
import shutil
import tempfile
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any, NamedTuple

import jax
import numpy as np
import xarray as xr

from undertow.analysis.metrics import Gathered, accumulators
from undertow.analysis.success import Success
from undertow.core import runtime
from undertow.core.disk import write_whole
from undertow.core.status import Status
from undertow.loop import continuous, sampled, simd_batch
from undertow.loop.closed_loop import ClosedLoop
from undertow.loop.outcome import Outcome
from undertow.numerics.random_keys import key_of_seed
from undertow.scenario.build import Built, build, in_its_precision
from undertow.scenario.consistency import record_period
from undertow.scenario.finished_run import Measuring, label, metrics_text
from undertow.scenario.provenance import text_hash
from undertow.scenario.reading import Text, dump
from undertow.scenario.schema import Initial, Loop
from undertow.scenario.step_size import step_failure

_OVERHEAD = 2**24  # bytes of a file of netCDF beside its numbers, at most


class Executed(NamedTuple):
    """One run of a scenario."""

    built: Built
    outcome: Outcome
    status: Status
    steady: dict[str, Any] | None  # metrics over the steady window; None when the run ended early
    whole: dict[str, Any]
    success: Success | None  # None without a criterion
    dataset: xr.Dataset


def execute(source: Text | Mapping[str, Any] | Built) -> Executed:
    """Run a scenario on the CPU: a single run has no work for a GPU.

    Args:
        source: a scenario, read, as data or built.

    Raises:
        BadInput: the scenario is invalid.
    """
    with runtime.on_processor():
        return _execute(source if isinstance(source, Built) else build(source))


@in_its_precision
def _execute(built: Built) -> Executed:
    scenario, gathered = built.scenario, gathered_of(built)
    ended = run_loop(built.closed_loop, scenario.loop, scenario.initial, scenario.seed, gathered)
    return finished(built, *ended, gathered)


def gathered_of(built: Built) -> Gathered:
    """What gathers the steady metrics along a run; () where the record is what counts."""
    if not built.scenario.steady.every_step:
        return ()
    return accumulators(built.closed_loop.plant, built.metrics, *built.window())


@in_its_precision
def finished(built: Built, outcome: Outcome, left_to_xla: Mapping[str, str], gathered: Gathered = ()) -> Executed:
    """A run with its metrics and its dataset; for outcome and `left_to_xla` see `run_loop`."""
    scenario, text = built.scenario, dump(built.resolved)
    why = step_failure(built.closed_loop, scenario.loop, outcome)
    attributes = (
        dict(left_to_xla)
        | ({"status_sentence": why} if why else {})
        | {
            "title": scenario.description or "a closed loop run by undertow",
            "scenario": text,
            "scenario_hash": text_hash(text),
            "code": built.code,
            "seed": scenario.seed,
        }
    )
    loop = scenario.loop
    how = Measuring(
        built.window(),
        loop.dt,
        built.metrics,
        built.criterion(),
        gathered,
        built.requirements,
        record_period(loop),
        loop.duration,
    )
    return Executed(built, outcome, *label(built.closed_loop, outcome, how, attributes))


def run_loop(
    loop: ClosedLoop,
    settings: Loop,
    start: Initial,
    seed: int,
    accumulators: tuple[sampled.AbstractAccumulator, ...] = (),
) -> tuple[Outcome, dict[str, str]]:
    """Run a closed loop with the keys `loop` and `initial` of a scenario; `accumulators` are for a sampled loop.

    Returns:
        The outcome, in NumPy arrays; and attribute `left_to_xla` of its dataset, the reason why the SIMD backend could
        not be used.
    """
    place = {key: None if value is None else np.asarray(value, dtype=float) for key, value in start}
    given: dict[str, Any] = {"duration": settings.duration, "dt": settings.dt, "key": key_of_seed(seed), **place}
    compilers: tuple[Callable[..., Outcome], Callable[..., Outcome]]
    if settings.kind == "continuous":
        given |= {"record_step": settings.record}
        if settings.method == "adaptive":
            tolerances = (settings.rtol, settings.atol)
            return jax.device_get(continuous.simulate(loop, tolerances=tolerances, **given)), {}
        compilers = simd_batch.integrate, continuous.simulate
    else:
        given |= {
            "record_every": round(settings.record / settings.dt),
            "method": settings.method,
            "substeps": settings.substeps,
            "accumulators": accumulators,
        }
        compilers = simd_batch.simulate, sampled.simulate
    by_simd, by_xla = compilers
    lacking: dict[str, str] = {}
    if settings.backend == "simd":
        try:
            return jax.device_get(by_simd(loop, **given)), {}
        except simd_batch.Unsupported as error:
            lacking = {"left_to_xla": str(error)}
    return jax.device_get(by_xla(loop, **given)), lacking


def write(executed: Executed, folder: Path) -> None:
    """Write run.nc, metrics.json and scenario.yaml to a folder.

    Raises:
        OSError: the folder cannot be written.
    """
    save(executed.dataset, folder / "run.nc")
    write_metrics(executed, folder, {})
    (folder / "scenario.yaml").write_text(dump(executed.built.resolved), encoding="utf-8")


def write_metrics(executed: Executed, folder: Path, further: Mapping[str, Any]) -> None:
    """Write metrics.json with further entries to a folder.

    Raises:
        OSError: the folder cannot be written.
    """
    (folder / "metrics.json").write_text(metrics_text(executed.dataset, further), encoding="utf-8")


def save(dataset: xr.Dataset, path: Path) -> None:
    """Write a dataset as netCDF; the file appears whole or not at all.

    Raises:
        OSError: the folder cannot be written.
    """
    # In a temporary folder with room for it first: where a disk fails while the library writes, the process crashes.
    with tempfile.TemporaryDirectory() as folder:
        if shutil.disk_usage(folder).free < dataset.nbytes + _OVERHEAD:
            raise OSError(errno.ENOSPC, "no room for the run; free some, or set TMPDIR to another folder", folder)
        file = Path(folder) / path.name
        try:
            dataset.to_netcdf(file, engine="netcdf4")
        except RuntimeError as error:  # NetCDF: HDF error, for whatever the disk says
            raise OSError(errno.EIO, f"it could not be written whole; is the disk full? ({error})", folder) from None
        write_whole(path, file.read_bytes())
