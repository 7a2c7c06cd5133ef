"""The command: one JSON, one page without network, progress on stderr, an exit code that says whether all was well."""

import json
import re

import pytest

from soak import command
from soak import soak as soaking
from soak.__main__ import run
from soak.inputs import Attack
from soak.verdict import EVENTS, Failure

pytestmark = pytest.mark.soak


@pytest.fixture
def here(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    return tmp_path


def test_soak_writes_one_json_and_one_page(here, capsys):
    assert run(["controls", "--short", "--seed", "5", "--out", "s"]) == 0
    said = capsys.readouterr()
    assert "Seed 5" in said.err and "controls: 4 done" in said.err
    summary = json.loads((here / "s" / "soak.json").read_text())
    assert summary["seed"] == 5 and summary["failures"] == [] and list(summary["parts"]) == ["controls"]
    assert summary["events"] == dict.fromkeys(EVENTS, 0)
    page = (here / "s" / "soak.html").read_text()
    assert "No never-event occurred." in page and "DOES NOT FAIL" not in page
    assert not re.search(r"(src|href)=\"(?!data:|#)", page)
    assert run(["controls", "--short", "--out", "s"]) == 2  # an earlier soak is not replaced in silence


def test_a_never_event_is_reported_with_its_files_and_exit_code_1(here, capsys, monkeypatch):
    failure = Failure("N2", "inputs/scenario/1/2", "exit code 3", ["check", "s.yaml"], ["s.yaml"])
    given = Attack(failure.identity, {"s.yaml": b"a: \xff", "folder": None}, ("check", "s.yaml"))
    part = lambda *arguments: ({"rows": []}, [failure], [(failure, given)])
    monkeypatch.setitem(soaking._PARTS, "controls", part)
    assert run(["controls", "--seed", "1", "--out", "s"]) == 1
    assert "N2 inputs/scenario/1/2: exit code 3" in capsys.readouterr().out
    kept = here / "s" / "failures" / "inputs-scenario-1-2"
    assert (kept / "s.yaml").read_bytes() == b"a: \xff" and (kept / "folder").is_dir()
    assert '["check", "s.yaml"]' in (kept / "command.txt").read_text()
    assert soaking.identities(here / "s" / "soak.json") == ["inputs/scenario/1/2"]
    assert "1 never-event occurred" in (here / "s" / "soak.html").read_text()


def test_a_failure_is_repeated_alone(here, capsys, monkeypatch):
    monkeypatch.setattr(soaking, "valid_files", lambda run: {})
    assert run(["--replay", "inputs/vehicle/1/3"]) == 0
    assert capsys.readouterr().out.startswith(
        "inputs/vehicle/1/3: no never-event. undertow check vehicle.yaml: exit code"
    )
    monkeypatch.setattr(command, "attacked", lambda arguments: 3)
    (here / "soak.json").write_text('{"failures": [{"identity": "inputs/vehicle/1/3"}]}')
    assert run(["--replay", "soak.json"]) == 1
    assert "N2, exit code 3" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["controlls"], "`PART` must be a part of a soak, but is controlls. Did you mean `controls`?"),
        (["--hours", "-1"], "`--hours` must be zero or positive, but is -1"),
        (["inputs", "--inputs", "0"], "`PART` must be a part of which there is more than nothing, but is inputs"),
        (["--replay", "x/y"], "`--replay` must be a file soak.json or the identity of a failure, but is x/y"),
        (["--replay", "inputs/scenario/1"], "`--replay` must be a file soak.json"),
        (["--replay", "missing.json"], "`--replay` must be a file soak.json"),
        (["--replay", "kills/1/2"], "`--replay` must be a file soak.json"),
    ],
)
def test_wrong_options_are_refused_in_one_line(here, capsys, words, said):
    assert run(words) == 2
    err = capsys.readouterr().err
    assert said in err and err.count("\n") == 1
    assert not list(here.iterdir())
