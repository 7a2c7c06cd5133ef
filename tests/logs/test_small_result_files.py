"""Result files of some kB that would unpack to gigabytes are refused before they are read, or read in parts."""

import tracemalloc

import netCDF4
import numpy as np
import pytest
import xarray as xr

from undertow.core.errors import BadInput
from undertow.core.unpacked_size import most_unpacked
from undertow.logs.read import read_log
from undertow.scenario.provenance import checksum
from undertow.scenario.reading import read


def result_file(path, numbers):
    """A result whose only series was declared and never written: a few kB, whatever its length."""
    with netCDF4.Dataset(path, "w") as file:
        file.createDimension("time", numbers)
        file.createVariable("position", "f8", ("time",), chunksizes=(2**16,))
        file.scenario = "plant: inverted_pendulum\n"
    assert path.stat().st_size < 100_000
    return path


def peak(function):
    tracemalloc.start()
    try:
        function()
        return tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()


def test_a_variable_that_was_never_written(tmp_path):
    path = result_file(tmp_path / "run.nc", 40_000_000)
    message = r"run.nc.* one of 320000000 bytes unpacked, more than the 268435456 that are read"
    for reader in (read, read_log):

        def refused(reader=reader):
            with pytest.raises(BadInput, match=message):
                reader(path)

        assert peak(refused) < 3e7


def test_checksums_are_computed_in_parts(tmp_path):
    """They are those of the whole arrays, and need little memory."""
    path = result_file(tmp_path / "run.nc", 4_000_000)
    with xr.open_dataset(path, engine="netcdf4") as dataset:
        sums = []
        assert peak(lambda: sums.append(checksum(dataset))) < 2e7  # the array has 32 MB
        assert sums[0] == checksum(dataset.load())
    several = np.random.default_rng(0).normal(size=(300_001, 3))
    dataset = xr.Dataset({"x": (("time", "axis"), several), "text": ("axis", ["a", "b", "c"]), "one": ((), 3)})
    first = checksum(dataset)
    several[300_000, 2] += 1.0  # the last number counts
    assert checksum(dataset) != first


def test_large_files_may_be_large():
    assert most_unpacked(10) == 2**28 and most_unpacked(10**9) == 10**11
