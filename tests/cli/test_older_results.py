"""Result files of a version that recorded fewer signals: repeated in all that they hold, or told why not."""

import numpy as np
import pytest
import xarray as xr

from undertow.scenario.provenance import checksum, content_hash
from undertow.scenario.results.repetition import compare, shortened


def labelled(**columns):
    run = xr.Dataset({name: ("time", values) for name, values in columns.items()}, coords={"time": [0.0, 1.0]})
    run = run.assign_attrs(content_hash=content_hash(run), scenario="", version_undertow="0.1.0")
    return run.assign_attrs(checksum=checksum(run))


NOW = labelled(position=np.array([1.0, 2.0]), lyapunov=np.array([4.0, 3.0]), lyapunov_rate=np.array([np.nan, -1.0]))


@pytest.fixture
def written(tmp_path):
    def write(run):
        run.to_netcdf(tmp_path / "before.nc", engine="netcdf4")
        return tmp_path / "before.nc"

    return write


def test_what_an_older_file_holds_is_repeated(written):
    found = compare(written(labelled(position=np.array([1.0, 2.0]))), NOW)
    assert found.equal
    said = "before.nc was repeated bit for bit in all its contents; new since then: lyapunov, lyapunov_rate"
    assert found.sentence == said


def test_an_older_file_that_differs_is_explained(written):
    found = compare(written(labelled(position=np.array([1.0, 2.5]))), NOW)
    assert not found.equal and found.explained
    said = "before.nc was not repeated bit for bit; other versions: one without lyapunov, lyapunov_rate"
    assert found.sentence == f"{said}. Differences: position"


def test_a_file_from_before_there_were_checksums_is_told(written):
    before = NOW.copy()
    del before.attrs["checksum"]
    found = compare(written(before), NOW)
    assert found.equal and found.sentence.endswith("; it has no checksum that could reveal changes to the file")


def test_missing_rates_do_not_hide_a_difference(written):
    """NaN at the first record: equal files are equal, others are not."""
    assert compare(written(NOW), NOW).equal
    other = labelled(position=np.array([1.0, 2.0]), lyapunov=np.array([4.0, 3.0]), lyapunov_rate=np.array([np.nan, -2]))
    found = compare(written(other), NOW)
    assert not found.equal and not found.explained


def test_a_shortened_file_is_compared_with_the_whole_run(written):
    """What it has left out is covered by the content hash; a difference there is told, too."""
    short = shortened(NOW, ("position", "estimate"))
    assert list(short.data_vars) == ["position"] and short.attrs["left_out"] == "lyapunov, lyapunov_rate"
    assert short.attrs["checksum"] == checksum(short) and len(NOW.data_vars) == 3
    found = compare(written(short), NOW)
    assert found.equal
    assert found.sentence == f"before.nc was repeated bit for bit (content hash {NOW.attrs['content_hash'][:12]})"
    other = labelled(position=np.array([1.0, 2.0]), lyapunov=np.array([4.0, 3.5]), lyapunov_rate=np.array([np.nan, -1]))
    found = compare(written(short), other)
    assert not found.equal and found.sentence.endswith("Differences: series that it has left out")
