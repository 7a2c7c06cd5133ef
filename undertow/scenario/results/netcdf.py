"""Result files: run.nc with the series and all facts of a run, metrics.json and scenario.yaml."""

import errno
import shutil
import tempfile
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import xarray as xr

from undertow.core.atomic_io import write_whole
from undertow.logs.result_file import opened_result
from undertow.scenario.reading import dump
from undertow.scenario.results.run_facts import facts_from
from undertow.scenario.results.run_result import RunRecord, RunResult

_OVERHEAD = 2**24  # bytes of a file of netCDF beside its numbers, at most


def write(result: RunResult, folder: Path) -> None:
    """Write run.nc, metrics.json and scenario.yaml to a folder.

    Raises:
        OSError: the folder cannot be written.
    """
    save(result.dataset, folder / "run.nc")
    write_metrics(result, folder, {})
    (folder / "scenario.yaml").write_text(dump(result.facts.scenario), encoding="utf-8")


def write_metrics(result: RunRecord, folder: Path, further: Mapping[str, Any]) -> None:
    """Write metrics.json with further entries to a folder.

    Raises:
        OSError: the folder cannot be written.
    """
    (folder / "metrics.json").write_text(result.facts.summary(further), encoding="utf-8")


def read_record(path: Path) -> RunRecord:
    """What a result file holds, written by this version of undertow.

    Raises:
        UnreadableResult: the file cannot be read.
        KeyError: it lacks an attribute.
    """
    with opened_result(path) as opened:
        dataset = opened.load()
    return RunRecord(dataset, facts_from(dataset.attrs))


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
