"""Logs that are saved: over others, on full disks, cut off later, with odd names, and with angles that are missing."""

import errno
import json

import numpy as np
import pytest
from mcap.reader import make_reader
from test_damage import AXES, TIME, a_log

from undertow.logs import log as log_module
from undertow.logs.log import Log
from undertow.logs.log_signals import Series
from undertow.logs.mcap_writer import pose_of
from undertow.logs.read import read_log


@pytest.mark.parametrize("name", ["a.csv", "a.mcap"])
def test_a_full_disk_leaves_the_file_that_was_there(tmp_path, monkeypatch, name):
    a_log().save(tmp_path / name)
    whole = (tmp_path / name).read_bytes()

    def full(log, path):
        path.write_bytes(whole[:100])
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setitem(log_module._WRITERS, f".{name[2:]}", full)
    with pytest.raises(OSError, match="No space left"):
        a_log().save(tmp_path / name)
    assert (tmp_path / name).read_bytes() == whole and [one.name for one in tmp_path.iterdir()] == [name]


def test_a_table_that_was_cut_off(tmp_path):
    """The row within which it ends is left out; a table that a hand wrote may end without a new line."""
    path = tmp_path / "a.csv"
    Log({"depth": Series(TIME, TIME + 0.123456, (), "m")}, "x", "CSV").save(path)
    whole = path.read_bytes()
    path.write_bytes(whole[:-5])
    log = read_log(path)
    np.testing.assert_array_equal(log["depth"].values, TIME[:-1] + 0.123456)
    assert log.notes == ("the file ends early, within line 51, which is left out",)
    for good in (whole, whole[:-1], whole.replace(b"\r\n", b"\n")[:-1]):
        path.write_bytes(good)
        assert len(read_log(path)["depth"].time) == 50 and not read_log(path).notes


def test_a_column_named_integer(tmp_path):
    values = np.array([[0.25, 1.75], [2.5, 3.5]])
    signals = {
        "mode": Series(TIME[:2], values, ("integer", "other"), "1", "integer"),
        "count": Series(TIME[:2], np.array([[[1], [2]], [[3], [4]]]), ("a", "number"), "1"),
    }
    Log(signals, "x", "CSV").save(tmp_path / "a.mcap")
    back = read_log(tmp_path / "a.mcap")
    np.testing.assert_array_equal(back["mode"].values, values)
    assert back["count"].values.dtype == int and back["count"].values.tolist() == signals["count"].values.tolist()


def test_a_missing_attitude_leaves_the_rest_in_view(tmp_path):
    """Others are as they were: linear between the samples that there are, without jumps of a turn."""
    angles = np.outer(TIME, [0.1, 0.2, 4.0])
    wrapped = (angles + np.pi) % (2 * np.pi) - np.pi
    wrapped[20] = np.nan
    signals = {
        "position": Series(TIME, np.outer(TIME, np.ones(3)), AXES[:3], "m"),
        "attitude": Series(TIME, wrapped, AXES[3:], "rad"),
    }
    found = pose_of(signals)
    assert found is not None
    np.testing.assert_allclose(found[1][:, 3:], angles, atol=1e-12)
    Log(signals, "x", "CSV").save(tmp_path / "a.mcap")
    with (tmp_path / "a.mcap").open("rb") as stream:
        shown = [json.loads(one.data) for _, _, one in make_reader(stream).iter_messages(topics=["/tf"])]
    assert len(shown) == len(TIME)
