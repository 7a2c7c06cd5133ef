"""`undertow arena`: laws enter one after the other, nothing is repeated, and damage is no result."""

import csv
import json
from pathlib import Path

import pytest

from undertow.cli import arena as command
from undertow.cli.main import run
from undertow.core.errors import BadInput
from undertow.scenario.reading import read
from undertow.studies.arena.entry import prepare_entry, read_entry
from undertow.studies.arena.tasks import VERSION
from undertow.studies.comparison import step_time
from undertow.studies.comparison.candidates import laws

SMALL = ["--trials", "2", "--tasks", "payload,pitch_turn", "--vehicles", "odin,rexrov", "--out", "out"]


@pytest.fixture
def folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(step_time, "_LONGEST", 0.01)  # s of calls of a law, for their median
    return tmp_path


def errors(text: str) -> dict[tuple[str, str, str], float]:
    rows = csv.DictReader(text.splitlines())
    return {(row["law"], row["task"], row["vehicle"]): float(row["error"]) for row in rows}


@pytest.mark.full
def test_two_laws_enter_one_after_the_other(folder, capsys):
    """The numbers of the first stay when the second enters, and a scenario of the folder repeats a trial."""
    assert run(["arena", "pid", *SMALL]) == 0
    first = errors(Path("out/leaderboard.csv").read_text())
    # Only ODIN of the two turns upside down.
    assert set(first) == {("pid", "payload", "odin"), ("pid", "payload", "rexrov"), ("pid", "pitch_turn", "odin")}
    stores = {path: path.stat().st_mtime_ns for path in Path("out/laws/pid/trials.zarr").rglob("*") if path.is_file()}
    assert run(["arena", "fast=robust", *SMALL]) == 0
    both = errors(Path("out/leaderboard.csv").read_text())
    assert {key: both[key] for key in first} == first and len(both) == 6
    assert run(["arena", "pid", *SMALL]) == 0  # again: no trial is repeated
    chunks = {path: at for path, at in stores.items() if path.parts[-3:] == ("c", "0", "0")}
    assert chunks and [path for path, at in chunks.items() if path.stat().st_mtime_ns != at] == []
    data = json.loads(Path("out/leaderboard.json").read_text())
    assert [law["name"] for law in data["laws"]] == sorted(
        ("pid", "fast"), key=lambda name: next(law["error"] for law in data["laws"] if law["name"] == name)
    )
    assert "| pid |" in Path("out/leaderboard.md").read_text() and "Leader board" in capsys.readouterr().out
    scenario = read(Path("out/laws/pid/scenarios/pitch_turn-odin.yaml"))
    assert scenario.data["reference"]["position"][4] == 2.0 and scenario.data["controller"] == {"kind": "pid"}


@pytest.mark.full
def test_a_law_of_a_file_and_one_that_is_refused(folder, capsys):
    """A file enters by its name; where a law does not accept a vehicle, the task counts as lost."""
    assert run(["init", "--own-controller"]) == 0
    picky = Path("my_controller.py").read_text() + (
        "\n\ndef picky(model) -> SlidingMode:\n"
        '    """For eight thrusters.\n\n    Args:\n        model: nominal model of the plant.\n    """\n'
        "    from undertow.core.errors import BadInput\n"
        "    count = len(model.in_body_axes().dynamics.allocation)\n"
        "    if count != 8:\n"
        '        raise BadInput("model", "have eight thrusters", count)\n'
        "    return my_controller(model)\n"
    )
    Path("my_controller.py").write_text(picky)
    tasks = ["--tasks", "payload", "--trials", "1", "--vehicles", "odin,bluerov2", "--out", "out"]
    assert run(["arena", "./my_controller.py:picky", *tasks]) == 0
    said = capsys.readouterr()
    assert "picky cannot run payload on bluerov2, which counts as lost" in said.err
    found = errors(Path("out/leaderboard.csv").read_text())
    assert found["picky", "payload", "bluerov2"] == 10 and found["picky", "payload", "odin"] < 1
    assert read_entry(Path("out/laws/picky")).refused.keys() == {("payload", "bluerov2")}


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        (["--tasks", "hover"], "`--tasks` must name tasks of the arena, but is hover"),
        (["--vehicles", "titanic"], "`--vehicles` must name vehicles of the arena"),
        (["--tasks", "pitch_turn", "--vehicles", "rexrov"], "`--tasks` must be tasks that one of the vehicles has"),
        (["--trials", "0"], "`--trials` must be"),
        (["--tune", "3"], "`--tune` must be at least 12"),
    ],
)
def test_mistakes(folder, capsys, arguments, says):
    assert run(["arena", "pid", "--out", "out", *arguments]) == 2
    assert says in capsys.readouterr().err
    assert not Path("out").exists()


@pytest.mark.full
def test_damage_and_other_versions(folder, capsys, monkeypatch):
    """An entry that cannot be read, is of another version, or of another law of the same name."""
    monkeypatch.setattr(command, "_trials", lambda *given: None)
    monkeypatch.setattr(command, "_conclude", lambda *given: 0)
    few = [*SMALL[:2], "--tasks", "payload", "--vehicles", "odin", "--out", "out"]
    assert run(["arena", "pid", *few]) == 0
    file = Path("out/laws/pid/entry.json")
    good = file.read_text()
    for bad, says in [
        ("[]", "have entries that can be read"),
        (good.replace('"name": "pid"', '"name": 7'), "have entries that can be read"),
        (good.replace(f'"version": {VERSION}', '"version": 0'), f"be of version {VERSION} of the arena"),
    ]:
        file.write_text(bad)
        assert run(["arena", "pid", *few]) == 2
        assert says in capsys.readouterr().err
    file.write_text(good)
    Path("other.yaml").write_text(
        "plant: {vehicle: odin}\ncontroller: {kind: pid, frequency: 2}\nreference: {kind: setpoint, position: [0,0,0,0,0,0]}\n"
    )
    assert run(["arena", "pid=other.yaml", *few]) == 2
    assert "`pid` must be the law that is in the folder" in capsys.readouterr().err
    assert file.read_text() == good


@pytest.mark.full
def test_a_store_that_is_damaged(folder, capsys):
    """The law is named, both when it continues and when another one enters beside it."""
    few = ["--trials", "1", "--tasks", "payload", "--vehicles", "odin", "--out", "out"]
    assert run(["arena", "pid", *few]) == 0
    Path("out/laws/pid/trials.zarr/zarr.json").write_text("garbage")
    assert run(["arena", "pid", *few]) == 2
    assert "zarr.json is damaged" in capsys.readouterr().err
    assert run(["arena", "again=pid", *few]) == 2
    said = capsys.readouterr().err
    assert "have results that can be read" in said and "Run the arena again for pid with --overwrite" in said
    assert run(["arena", "pid", *few, "--overwrite"]) == 0


def test_every_law_of_the_default_list_is_known():
    assert [one.name for one in laws(list(command.EVERY))] == list(command.EVERY)


@pytest.mark.full
def test_a_law_that_no_vehicle_accepts_is_an_error():
    """With the reason, and nothing that could be taken for a result."""
    (law,) = laws(["pid"])
    law = law._replace(changes={"controller": {"kind": "pid", "frequency": -1}})
    with pytest.raises(BadInput, match="frequency"):
        prepare_entry(law, 1, (("payload", "odin"), ("delay", "rexrov")))
    with pytest.raises(BadInput, match="entries that can be read"):
        read_entry(Path("nowhere"))
