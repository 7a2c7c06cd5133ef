"""`undertow logs`: what is in a log, conversion, a layout, the score; and what `simulate` writes beside run.nc."""

import json

import numpy as np
import pytest
import xarray as xr

import undertow as ut
from undertow.cli.main import run

pytestmark = pytest.mark.full

SCENARIO = """
plant: {vehicle: bluerov2_heavy, thruster: {kind: t200, supply: 16}}
controller: {kind: pid, frequency: 1}
reference: {kind: setpoint, position: [1, 0.5, 0.2, 0, 0, 0.3], settling: 3}
loop: {duration: 14, dt: 0.05, record: 0.05}
"""
TABLE = "t_ms,depth_cm,pwm\n0,100,1500\n100,102,1600\n200,104,1700\n1500,106,1500\n"
MAPPING = """
time: {column: t_ms, unit: ms}
signals:
  depth: {columns: depth_cm, unit: cm}
  input: {columns: [pwm], unit: us, supply: 16}
"""


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """A finished run, with its recording for Rerun."""
    where = tmp_path_factory.mktemp("logs")
    (where / "s.yaml").write_text(SCENARIO)
    out = ["--out", str(where / "run"), "--no-prediction", "--rerun", str(where / "run.rrd")]
    assert run(["simulate", str(where / "s.yaml"), *out]) == 0
    return where


def test_simulate_writes_the_log(folder):
    log = ut.read_log(folder / "run/run.mcap")
    with xr.open_dataset(folder / "run/run.nc") as dataset:
        for name, series in log.signals.items():
            np.testing.assert_array_equal(series.values, dataset[name].values)
        assert log.facts["scenario_hash"] == dataset.attrs["scenario_hash"]
        assert log.facts["content_hash"] == dataset.attrs["content_hash"]


def test_rerun_reads_its_recording(folder, monkeypatch):
    """By Rerun's own reader: the entities, and the values of one of them."""
    monkeypatch.setenv("RERUN_ANALYTICS", "0")
    from rerun.chunk import RrdReader

    chunks = RrdReader(folder / "run.rrd").stream().to_chunks()
    assert {"/motion/position", "/thrusters/input", "/world/vehicle", "/world/path"} <= {
        one.entity_path for one in chunks
    }
    tables = [one.to_record_batch() for one in chunks if one.entity_path == "/motion/position" and not one.is_static]
    values = np.concatenate([np.array(table["Scalars:scalars"].to_pylist()) for table in tables])
    with xr.open_dataset(folder / "run/run.nc") as dataset:
        np.testing.assert_array_equal(values, dataset["position"].values)


def test_what_is_in_a_log(folder, capsys):
    assert run(["logs", str(folder / "run/run.mcap")]) == 0
    said = capsys.readouterr().out
    assert "run.mcap: undertow, " in said and "14 s" in said
    assert "World axes are north, east, down" in said
    position = next(line for line in said.splitlines() if " position " in line)
    assert "281" in position and "20" in position and "north, ..., yaw (6)" in position


def test_a_table_with_a_mapping(tmp_path, capsys, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "dive.csv").write_text(TABLE)
    (tmp_path / "dive.yaml").write_text(MAPPING)
    assert run(["logs", "dive.csv"]) == 2
    assert "`mapping` must be given, but is dive.csv" in capsys.readouterr().err
    assert run(["logs", "dive.csv", "--mapping", "dive.yaml", "--out", "dive.mcap"]) == 0
    said = capsys.readouterr().out
    assert "depth_cm (cm, down)" in said and "Written: dive.mcap" in said
    depth = next(line for line in said.splitlines() if " depth " in line)
    assert "1.3" in depth and "1 " in depth  # one gap, of 1.3 s
    log = ut.read_log(tmp_path / "dive.mcap")
    np.testing.assert_allclose(log["depth"].values, [1, 1.02, 1.04, 1.06])
    np.testing.assert_allclose(log["input"].values[:, 0], [0, 4, 8, 0])
    np.testing.assert_allclose(log["depth"].time, [0, 0.1, 0.2, 1.5])
    assert run(["logs", "dive.csv", "--mapping", "dive.yaml", "--out", "dive.mcap"]) == 2
    assert "Add --overwrite" in capsys.readouterr().err
    assert run(["logs", "dive.mcap", "--out", "dive.mcap", "--overwrite"]) == 2
    assert "`--out` must be another file than the log itself" in capsys.readouterr().err


def test_a_line_of_the_mapping_is_named(tmp_path, capsys, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "dive.csv").write_text(TABLE)
    for change, said in (
        (("unit: cm", "unit: deg"), "`mapping.signals.depth.unit` must be one of m, cm, mm for `depth`, but is deg (m.yaml, line 4)"),
        (("depth_cm", "depth_m"), "`mapping.signals.depth.columns` must be in dive.csv, but is depth_m (m.yaml, line 4)"),
        (("unit: us, supply: 16", "unit: us"), "`mapping.signals.input.supply` must be given, V"),
        (("signals:", "signal:"), "`mapping.signal` must be a key here, but is unknown (m.yaml, line 3). Did you mean `signals`?"),
    ):  # fmt: skip
        (tmp_path / "m.yaml").write_text(MAPPING.replace(*change))
        assert run(["logs", "dive.csv", "--mapping", "m.yaml"]) == 2
        assert said in capsys.readouterr().err


def test_times_since_1970(tmp_path, capsys):
    """Six digits would be the same for all of them."""
    (tmp_path / "dive.csv").write_text("t,depth\n" + "".join(f"{1710773350.35 + k / 8},{k}\n" for k in range(9)))
    (tmp_path / "dive.yaml").write_text("time: t\nsignals: {depth: {columns: depth}}\n")
    assert run(["logs", str(tmp_path / "dive.csv"), "--mapping", str(tmp_path / "dive.yaml")]) == 0
    said = capsys.readouterr().out
    assert "1710773350.350" in said and "1710773351.350" in said
    assert "times are from 2024-03-18 14:49:10 to 2024-03-18 14:49:11 UTC" in said


def test_the_score(folder, capsys, monkeypatch):
    """Against itself the model is as near as its records are; the results hold what is printed."""
    monkeypatch.chdir(folder)
    assert run(["logs", "score", "s.yaml", "run/run.mcap"]) == 0
    said = capsys.readouterr().out
    assert "over 1 starts" in said and "Results: runs/s-score" in said
    found = json.loads((folder / "runs/s-score/score.json").read_text())
    assert found["starts"] == [2.0] and list(found["rms"]) == ["1", "5", "10"]
    assert max(found["rms"]["10"].values()) < 1e-6
    assert (folder / "runs/s-score/figures/score.svg").read_text().startswith("<?xml")
    (folder / "other.yaml").write_text(
        SCENARIO.replace("vehicle: bluerov2_heavy", "vehicle: {kind: bluerov2_heavy, parameters: wu2018}")
    )
    assert run(["logs", "score", "other.yaml", "run/run.nc", "--out", "other"]) == 0
    assert json.loads((folder / "other/score.json").read_text())["rms"]["5"]["north"] > 0.05
    capsys.readouterr()
    (folder / "odin.yaml").write_text(
        "plant: {vehicle: bluerov2, thruster: t200}\nreference: {kind: setpoint, position: [0, 0, 0, 0, 0, 0]}\n"
    )
    assert run(["logs", "score", "odin.yaml", "run/run.mcap", "--out", "third"]) == 2
    assert "must have 6 inputs, as many as the vehicle has thrusters" in capsys.readouterr().err
    assert not (folder / "third").exists()


def test_the_layout(tmp_path, capsys, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert run(["logs", "layout"]) == 0
    assert "3D!view" in json.loads((tmp_path / "undertow-foxglove.json").read_text())["configById"]
    assert run(["logs", "layout"]) == 2
    assert run(["logs", "layout", "--overwrite"]) == 0
    capsys.readouterr()


@pytest.mark.parametrize(
    "words, said",
    [
        (["missing.mcap"], "`log` must be an existing file, but is missing.mcap"),
        (["score", "s.yaml"], "`logs` must be followed by score SCENARIO FILE"),
        (["layout", "x"], "`logs` must be followed by layout"),
        (["a.csv", "b.csv"], "`logs` must be followed by FILE"),
        (["layout", "--out", "x.txt"], "`--out` must be a file whose name ends in .json"),
    ],
)
def test_what_is_wrong(words, said, capsys, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert run(["logs", *words]) == 2
    assert said in capsys.readouterr().err


def test_a_recording_for_rerun_that_cannot_be_written(tmp_path, capsys):
    (tmp_path / "s.yaml").write_text(SCENARIO)
    (tmp_path / "there.rrd").write_text("")
    for name, said in (
        ("a.mp4", "ends in .rrd"),
        ("no/a.rrd", "be in an existing folder"),
        ("there.rrd", "be a new file"),
    ):
        assert (
            run(["simulate", str(tmp_path / "s.yaml"), "--out", str(tmp_path / "out"), "--rerun", str(tmp_path / name)])
            == 2
        )
        assert said in capsys.readouterr().err
    assert not (tmp_path / "out").exists()
