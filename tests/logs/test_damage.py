"""Files that are damaged, cut off, or of somebody else: one line that names the file and the place, or what is left."""

import netCDF4
import numpy as np
import pytest
from other_programs import json_mcap, ros1_bag
from test_log_formats import bag, bin_file, ros_messages, ulg_file
from test_mavlink_logs import tlog_file

from undertow.core.errors import BadInput
from undertow.logs import result_file
from undertow.logs.csv_writer import write_csv
from undertow.logs.log import Log
from undertow.logs.log_signals import Series
from undertow.logs.mapping import mapping_of
from undertow.logs.mcap_writer import LiveLog, write_mcap
from undertow.logs.read import read_log

AXES = ("north", "east", "down", "roll", "pitch", "yaw")
TIME = np.arange(50) * 0.05


def a_log():
    chance = np.random.default_rng(3)
    weights = chance.normal(size=(50, 6, 3))
    weights[7, 2, 1], weights[8, 0, 0], weights[9, 0, 0] = np.nan, np.inf, -np.inf
    signals = {
        "position": Series(TIME, chance.normal(size=(50, 6)), AXES, "m, rad", "position"),
        "input": Series(TIME, chance.normal(size=(50, 8)), tuple(f"T{i}" for i in range(1, 9)), "V", "input applied"),
        "weights": Series(TIME, weights, AXES, "m/s^2", 'weights, 100 % of "them"'),
        "bad_readings": Series(TIME, np.arange(50) ** 9, (), "1", "readings"),
        "depth": Series(TIME[::10] + 0.01, chance.normal(size=5), (), "m", "depth"),
    }
    return Log(signals, "a.mcap", "undertow", ("a note",), {"title": "some run"})


def equal(one, other):
    return one.dtype == other.dtype and np.array_equal(one, other, equal_nan=one.dtype.kind == "f")


def test_mcap_keeps_everything(tmp_path):
    log = a_log()
    write_mcap(log, tmp_path / "a.mcap")
    back = read_log(tmp_path / "a.mcap")
    assert (back.source, back.format, back.notes, back.facts) == (log.source, log.format, log.notes, log.facts)
    assert back.signals.keys() == log.signals.keys()
    for name, series in log.signals.items():
        found = back[name]
        assert equal(found.time, series.time) and equal(found.values, series.values), name
        assert (found.columns, found.unit, found.meaning) == (series.columns, series.unit, series.meaning)


def test_csv_keeps_the_numbers(tmp_path):
    log = a_log()
    write_csv(log, tmp_path / "a.csv")
    back = read_log(tmp_path / "a.csv")
    for name, series in log.signals.items():
        found = back[name]
        assert equal(found.time, series.time) and found.unit == series.unit
        np.testing.assert_array_equal(found.flat(), series.flat())
    assert back["position"].columns == AXES and back["weights"].columns[1] == "north.2"


def good_file(kind, folder):
    """A good file of a kind, and its mapping."""
    if kind == "mcap":
        write_mcap(a_log(), folder / "a.mcap")
        return folder / "a.mcap", None
    if kind == "csv":
        write_csv(a_log(), folder / "a.csv")
        return folder / "a.csv", None
    if kind == "json":
        json_mcap(folder / "j.mcap", {"/p": [(i * 10**8, {"x": i, "y": 2.5}) for i in range(30)]})
        return folder / "j.mcap", mapping_of({"signals": {"depth": {"topic": "/p", "columns": "y"}}})
    if kind in ("db3", "ros_mcap"):
        made = bag(folder / "bag", {"db3": "sqlite3", "ros_mcap": "mcap"}[kind])
        return next(one for one in made.iterdir() if one.suffix in (".db3", ".mcap")), None
    if kind.startswith("ros1"):
        return ros1_bag(folder / "a.bag", ros_messages(), kind.partition(".")[2] or "none", 2**13), None
    if kind == "tlog":
        return tlog_file(folder / "a.tlog"), None
    if kind == "bin":
        return bin_file(folder / "a.bin"), None
    return ulg_file(folder / "a.ulg", odometry=kind == "odometry.ulg"), None


def damaged(whole, chance):
    """Bytes with some changed, left out, repeated or inserted; or cut off."""
    data = bytearray(whole)
    for _ in range(chance.integers(1, 5)):
        place = int(chance.integers(len(data))) if data else 0
        match chance.integers(6):
            case 0 | 1:
                data[place : place + 1] = bytes([chance.integers(256)])
            case 2:
                data[place : place + 8] = chance.bytes(8)
            case 3:
                del data[place : place + int(chance.integers(1, 40))]
            case 4:
                data[place:place] = data[place : place + 20]
            case _:
                del data[max(1, place) :]
    return bytes(data)


KINDS = ("mcap", "csv", "json", "db3", "ros_mcap", "ros1", "ros1.lz4", "bin", "tlog", "ulg", "odometry.ulg")


@pytest.mark.full
@pytest.mark.parametrize("kind", KINDS)
def test_damaged_files(tmp_path, kind, capsys):
    """Nothing but a log, or one line that names the file, comes of 150 damaged files."""
    path, mapping = good_file(kind, tmp_path)
    whole, chance, refused = path.read_bytes(), np.random.default_rng(11), 0
    assert len(read_log(path, mapping).signals) > 0
    for _ in range(150):
        path.write_bytes(damaged(whole, chance))
        try:
            log = read_log(path, mapping)
        except BadInput as error:
            refused += 1
            assert path.name in str(error) and "\n" not in str(error), str(error)
        else:
            assert isinstance(log, Log) and repr(log)
    assert refused > (
        0 if kind in ("tlog", "ros1", "ros1.lz4") else 10
    )  # whose frames and records stand for themselves
    assert not any(capsys.readouterr())


def test_a_file_that_ends_early(tmp_path):
    """What was written before is there, and a note."""
    write_mcap(a_log(), tmp_path / "a.mcap")
    whole = (tmp_path / "a.mcap").read_bytes()
    live = LiveLog(tmp_path / "b.mcap", {"input": a_log()["input"]}, {})
    for i in range(2000):
        live.write((0.01 * i, {"input": np.full(8, i / 7)}))
    half = (tmp_path / "b.mcap").read_bytes()
    (tmp_path / "c.mcap").write_bytes(half[: len(half) - 50])
    log = read_log(tmp_path / "c.mcap")
    rows = len(log["input"].time)
    assert 1500 < rows < 2000
    np.testing.assert_array_equal(log["input"].values, np.repeat(np.arange(rows)[:, None] / 7, 8, axis=1))
    assert log.notes[-1].startswith("the file ends early, within the record at byte")
    live.close()
    assert len(read_log(tmp_path / "b.mcap")["input"].time) == 2000
    (tmp_path / "d.mcap").write_bytes(whole[:20])
    with pytest.raises(BadInput, match=r"`log` must be an undamaged MCAP file, but is d.mcap: at byte 0"):
        read_log(tmp_path / "d.mcap")


@pytest.mark.parametrize(
    "text, said",
    [
        ("t,x\n0,1\n1,2,3\n", r"have 2 cells in every row, but is a.csv, line 3 with 3"),
        ("t,x\n0,1_000\n1,2\n", r"hold numbers, but is a.csv, line 2, column x: 1_000"),
        ("t,x\n0,1e999\n1,2\n", r"hold numbers, but is a.csv, line 2, column x: 1e999"),
        ("t,x\n0,1\n1,fast\n", r"hold numbers, but is a.csv, line 3, column x: fast"),
        ("t,x\n0,1\n1,2\n1.5,2\n0.5,2\n", r"increasing times, but is a.csv, depth, sample 4: 0.5 s after 1.5 s"),
        ("t,x\n0,1\n,2\n", r"have finite times, but is a.csv, depth, sample 2: nan"),
        ("t,x\n", r"have a header and at least one row"),
        ("t,x,x\n1,2,3\n", r"columns of different names, but is a.csv, where `x` occurs 2 times"),
        ("t,y\n1,2\n", r"`mapping.signals.depth.columns` must be in a.csv, but is x. Known: t, y"),
        ("s,x\n1,2\n", r"`mapping.time.column` must be in a.csv, but is t"),
    ],
)
def test_wrong_csv(tmp_path, text, said):
    (tmp_path / "a.csv").write_text(text)
    with pytest.raises(BadInput, match=said):
        read_log(tmp_path / "a.csv", mapping_of({"time": "t", "signals": {"depth": {"columns": "x"}}}))


@pytest.mark.parametrize(
    "change, said",
    [
        ({"speed": {"columns": "x"}}, r"`signals.speed` must be a known signal"),
        ({"depth": {"columns": "x", "unit": "rad"}}, r"`signals.depth.unit` must be one of m, cm, mm for `depth`, but is rad"),
        ({"depth": {"column": "x"}}, r"`signals.depth.column` must be a key here, but is unknown. Did you mean `columns`\?"),
        ({"depth": {"columns": 3}}, r"`signals.depth.columns` must be names of columns, but is 3"),
        ({"position": {"columns": ["x"]}}, r"`signals.position.columns` must be 3: north, east, down, but is 1"),
        ({"input": {"columns": ["x"], "unit": "us"}}, r"`signals.input.supply` must be given, V"),
        ({"input": {"columns": ["x"], "supply": 16}}, r"`signals.input.supply` must be left out unless the unit is us, 1, %"),
        ({"input": {"columns": ["x"], "unit": "us", "supply": -1}}, r"`signals.input.supply` must be a positive number"),
        ({"input": {"columns": ["x1..x999"]}}, r"`signals.input.columns` must be from 1 to 64 columns"),
        ({"position": {"columns": list("xyz"), "world": "NWU"}}, r"`signals.position.world` must be NED or ENU, but is NWU"),
        ({"attitude": {"columns": list("xyz")}, "quaternion": {"columns": list("wxyz")}}, r"`signals.quaternion` must be left out where"),
        ({}, r"`signals` must be a mapping of signals"),
    ],
)  # fmt: skip
def test_wrong_mappings(change, said):
    with pytest.raises(BadInput, match=said):
        mapping_of({"signals": change})


@pytest.mark.parametrize(
    "data, said",
    [
        ([], "`mapping` must be a mapping"),
        ({}, "`signals` must be given"),
        ({"signals": {"depth": {"columns": "x"}}, "frame": "ENU"}, "`frame` must be a key here"),
        (
            {"signals": {"depth": {"columns": "x"}}, "time": {"column": "t", "unit": "min"}},
            "`time.unit` must be one of s",
        ),
        ({"signals": {"depth": {"columns": "x"}}, "time": {"unit": "s"}}, "`time.column` must be given"),
    ],
)
def test_wrong_keys_of_a_mapping(data, said):
    with pytest.raises(BadInput, match=said):
        mapping_of(data)


def test_files_of_no_known_format(tmp_path):
    (tmp_path / "a.xyz").write_text("x")
    (tmp_path / "a.csv").write_text("t,x\n1,2\n")
    (tmp_path / "a.nc").write_text("t,x\n1,2\n")
    (tmp_path / "a.bin").write_text("t,x\n1,2\n")
    (tmp_path / "empty.ulg").write_bytes(b"")
    cases = {
        "a.xyz": r"`log` must be one of .mcap, .csv, .*, or the folder of a bag, but is a.xyz",
        "b.csv": r"`log` must be an existing file",
        "a.csv": r"`mapping` must be given, but is a.csv, a CSV file whose columns may mean anything.*columns \(t, x",
        "a.nc": r"`log` must be the run.nc of a run, but is a.nc",
        "a.bin": r"`log` must be a .bin file of ArduPilot, but is a.bin, which does not begin like one",
        "empty.ulg": r"`log` must be an undamaged .ulg file of PX4, but is empty.ulg, near byte 0: Invalid file format",
        "": r"`log` must be a file, or the folder of a bag of ROS 2",
    }
    for name, said in cases.items():
        with pytest.raises(BadInput, match=said):
            read_log(tmp_path / name)


def test_a_mapping_for_a_file_that_needs_none(tmp_path):
    write_mcap(a_log(), tmp_path / "a.mcap")
    with pytest.raises(BadInput, match="`mapping` must be left out for a log whose signals are known"):
        read_log(tmp_path / "a.mcap", mapping_of({"signals": {"depth": {"columns": "x"}}}))


def test_times_that_are_missing_or_too_many(tmp_path):
    (tmp_path / "a.csv").write_text("t,x\n0,1\n1,2\n")
    with pytest.raises(BadInput, match=r"`mapping.time` must be given: the column of the time, and its unit"):
        read_log(tmp_path / "a.csv", mapping_of({"signals": {"depth": {"columns": "x"}}}))
    path, _ = good_file("json", tmp_path)
    signals = {"depth": {"topic": "/p", "columns": "y"}}
    with pytest.raises(BadInput, match=r"`mapping.time` must be left out: the messages of j.mcap have times"):
        read_log(path, mapping_of({"time": "x", "signals": signals}))


def test_missing_topics_and_columns(tmp_path):
    path, _ = good_file("json", tmp_path)
    for signals, said in (
        (
            {"topic": "/q", "columns": "y"},
            r"`mapping.signals.depth.topic` must name one of the 1 topics of the log, but is /q",
        ),
        ({"topic": "/p", "columns": "z"}, r"`mapping.signals.depth.columns` must be in j.mcap, but is z"),
    ):
        with pytest.raises(BadInput, match=said):
            read_log(path, mapping_of({"signals": {"depth": signals}}))


@pytest.mark.full
def test_pulses_become_volts_as_the_speed_controllers_have_it():
    from undertow.logs.mapped_log import volts
    from undertow.logs.mapping import SignalMapping
    from undertow.physics.power.esc import esc

    pulses = np.arange(1050.0, 1950.0, 7.0)
    entry = SignalMapping(("x",), unit="us", supply=16.0)
    np.testing.assert_allclose(
        volts(pulses, entry, 16.0), np.asarray(esc().voltage(pulses, np.asarray(16.0))), atol=1e-14
    )
    assert (volts(np.array([-2.0, 0.5]), entry._replace(unit="1"), 16.0) == [-16.0, 8.0]).all()


def test_gaps_are_counted():
    time = np.concatenate([np.arange(100) * 0.01, 5 + np.arange(50) * 0.01])
    values = np.where(time > 5.2, np.nan, 1.0)
    found = Log({"depth": Series(time, values, (), "m")}, "x", "CSV").sampling("depth")
    assert (found.samples, found.gaps) == (150, 1) and found.longest_gap == pytest.approx(4.01)
    assert found.rate == pytest.approx(100) and found.missing == pytest.approx(29 / 150)


def test_a_netcdf_file_that_its_library_reads_for_ever(tmp_path, monkeypatch):
    """The first entry of a heap has number 0 and length 0, so that HDF5 comes back to it without end."""
    monkeypatch.setattr(result_file, "_LONGEST", 3.0)  # s
    path = tmp_path / "run.nc"
    with netCDF4.Dataset(path, "w") as file:
        file.createDimension("time", 4)
        file.createVariable("time", "f8", ("time",))
        file.createVariable("position", "f8", ("time",))
    damaged = bytearray(path.read_bytes())
    heap = damaged.index(b"GCOL")
    damaged[heap + 16 : heap + 32] = bytes(16)
    path.write_bytes(damaged)
    with pytest.raises(BadInput, match=r"run\.nc.* damaged: the netCDF library does not finish opening it"):
        read_log(path)
