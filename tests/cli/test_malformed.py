"""Whatever somebody types or a disk does to a file: one line and an exit code that is documented, never an internal error.

A few changes by default; `pytest -m slow` tries thousands. Another seed: UNDERTOW_FUZZ_SEED=7 (the number of a case that
failed is in the name of the test, and makes the same file again).
"""

import os
import random
import shutil

import malformed
import pytest

from undertow.cli import campaign
from undertow.core.status import Status
from undertow.report import figures
from undertow.report.plotted import Plotted

pytestmark = pytest.mark.full

DONE, RUN_FAILED, BAD_INPUT = 0, 1, 2
BEGIN = int(os.environ.get("UNDERTOW_FUZZ_SEED", 0)) * 1_000_000
FEW, MANY = 6, 1500
FAILED = [status.word for status in Status if status is not Status.OK]


@pytest.fixture
def undrawn(monkeypatch, tmp_path):
    """Drawing takes most of the time of a short run, and has tests of its own. Files that examples name are there."""
    monkeypatch.setattr(figures, "plot_run", lambda run, width: Plotted({}, {}, []))
    monkeypatch.setattr(campaign, "write_campaign", lambda title, results, found, folder, pdf, replays: (folder, []))
    for name in ("d.csv", "my_rov.yaml"):
        shutil.copy(malformed.EXAMPLES / name, tmp_path / name)


def one_line(said):
    """A documented end, and one line that says why it is not a good one; that of a run or a check may be in its table."""
    complaints = [line for line in said.err.splitlines() if not line.startswith("Advice: ")]
    assert said.code in (DONE, RUN_FAILED, BAD_INPUT), said
    shown = any(words in said.out for words in (*FAILED, "1 error", " errors"))
    assert len(complaints) in ((0,) if said.code == DONE else (0, 1) if shown else (1,)), said
    assert all(line.startswith("Error: ") and len(line) < 2000 for line in complaints), said


def tried(undertow, folder, command, case, examples):
    chance = random.Random(BEGIN + case)
    text = (malformed.campaign if command == "campaign" else malformed.scenario)(chance, examples)
    (folder / "s.yaml").write_bytes(text.encode("utf-8", "surrogatepass"))
    out = () if command == "check" else ("--out", "out")
    said = undertow(command, "s.yaml", *out, *(("--workers", "1") if command == "campaign" else ()))
    one_line(said)
    if said.code == BAD_INPUT:
        assert not (folder / "out").exists() and not list(folder.glob(".*")), said


@pytest.mark.parametrize("command", ["simulate", "check", "campaign"])
@pytest.mark.parametrize("case", range(FEW))
def test_changed_examples(undertow, undrawn, tmp_path, command, case):
    tried(undertow, tmp_path, command, case, malformed.QUICK)


@pytest.mark.slow
@pytest.mark.parametrize("command", ["simulate", "check", "campaign"])
@pytest.mark.parametrize("case", range(FEW, MANY))
def test_many_changed_examples(undertow, undrawn, tmp_path, command, case):
    tried(undertow, tmp_path, command, case, malformed.SCENARIOS)


JUNK = {
    "empty": b"",
    "zeros": bytes(64),
    "all bytes": bytes(range(256)),
    "a picture": b"\x89PNG\r\n\x1a\n" + bytes(40),
    "half of a character": b"seed: \xe2\x82",
    "utf-16": "seed: 3\n".encode("utf-16"),
    "lone surrogate": b"seed: \xed\xa0\x80",
    "a NUL": b"seed: 3\x00\n",
    "a bom alone": b"\xef\xbb\xbf",
    "bom and key": b"\xef\xbb\xbfsede: 3\n",
    "hdf5 and nothing": b"\x89HDF\r\n\x1a\n" + bytes(8),
    "netcdf 3 and nothing": b"CDF\x01" + bytes(8),
    "zip": b"PK\x03\x04" + bytes(30),
    "deep brackets": b"a: " + b"[" * 200,
    "deep braces": b"{a: " * 200,
    "deep blocks": b"".join(b" " * i + b"a:\n" for i in range(400)),
    "one long line": b"a: " + b"x" * 20_000,
    "set": b"plant: !!set {a, b}\n",
    "omap": b"plant: !!omap [a: 1]\n",
    "python": b"plant: !!python/object/apply:os.system [ls]\n",
    "own tag": b"plant: !mine 3\n",
    "binary": b"seed: !!binary aGVsbG8=\n",
    "merge of nothing": b"loop: {<<: 3}\n",
    "another version": b"%YAML 3.0\n---\nseed: 3\n",
}
COMMANDS = {
    "simulate": ("simulate",),
    "analyze": ("analyze",),
    "tune": ("tune",),
    "check": ("check",),
    "describe": ("describe",),
    "campaign": ("campaign",),
}


@pytest.mark.parametrize("suffix", ["yaml", "nc"])
@pytest.mark.parametrize("junk", JUNK)
def test_files_of_something_else(refused, tmp_path, junk, suffix):
    (tmp_path / f"s.{suffix}").write_bytes(JUNK[junk])
    for command in COMMANDS:
        assert " must " in refused(command, f"s.{suffix}")


TABLES = {
    "empty": b"",
    "zeros": bytes(99),
    "no header": b"0,1\n1,2\n",
    "words": b"t,d1\n0,a\n1,b\n",
    "huge": b"t,d1\n0,1e400\n1,2\n",
    "nan": b"t,d1\n0,nan\n1,2\n",
    "quotes": b't,d1\n0,"1\n1,2\n',
    "backwards": b"t,d1\n1,1\n0,2\n",
    "long field": b't,d1\n0,"' + b"1" * 200_000 + b'"\n1,2\n',
    "digits": b"t,d1\n0," + b"1" * 5000 + b"\n1,2\n",
    "binary": bytes(range(256)) * 4,
    "semicolons": b"t;d1\n0;1\n1;2\n",
    "ragged": b"t,d1\n0,1,2\n1\n",
    "many columns": b"t" + b"".join(b",d%d" % i for i in range(1, 40)) + b"\n" + (b"0" + b",1" * 39 + b"\n") * 2,
}
RECORDED = """\
plant: {kind: double_integrator, axes: 1, limit: 20}
controller: {kind: pid}
reference: {kind: setpoint, position: [0]}
disturbance: {kind: table, file: d.csv}
loop: {duration: 0.04, dt: 0.01, record: 0.01}
"""


@pytest.mark.parametrize("table", TABLES)
def test_tables_of_something_else(refused, tmp_path, table):
    (tmp_path / "d.csv").write_bytes(TABLES[table])
    (tmp_path / "s.yaml").write_text(RECORDED)
    (tmp_path / "c.yaml").write_text("scenario: s.yaml\ntrials: 2\n")
    for command in (("simulate", "s.yaml"), ("check", "s.yaml"), ("campaign", "c.yaml")):
        assert "disturbance" in refused(*command)


BOMBS = {
    "entries": "seed: [" + "1,\n" * 150_000 + "]\n",
    "aliases": "a: &a [1, 1, 1, 1, 1, 1, 1, 1, 1, 1]\n"
    + "".join(f"{b}: &{b} [{', '.join([f'*{a}'] * 10)}]\n" for a, b in zip("abcdefgh", "bcdefghi", strict=True)),
    "merges": "a: &a {" + ", ".join(f"k{i}: {i}" for i in range(300)) + "}\n" + "b: [" + "{<<: *a}, " * 300 + "]\n",
}


@pytest.mark.parametrize("bomb", BOMBS)
def test_a_file_that_stands_for_too_much_is_left_early(refused, tmp_path, monkeypatch, bomb):
    """Before anything is built of it: no more of it is read than there may be."""
    from undertow.scenario import yaml_text

    counted = []
    real = yaml_text._Composer._node
    monkeypatch.setattr(yaml_text._Composer, "_node", lambda *given: counted.append(1) or real(*given))
    monkeypatch.setattr(yaml_text, "_plain", None)
    monkeypatch.setattr(yaml_text, "_MOST", 5000)
    (tmp_path / "s.yaml").write_text(BOMBS[bomb])
    said = refused("simulate", "s.yaml")
    assert said.startswith("`s.yaml` must have at most 5000 entries, but is larger (s.yaml, line ")
    assert len(counted) <= 5001


def test_aliases_are_copies():
    """What one place says is changed at that place alone."""
    from pathlib import Path

    from undertow.scenario.reading import parse

    found = parse("a: &x {b: [1, 2]}\nc: *x\nd: {<<: *x, e: 3}\n", "s.yaml", Path(), "SCENARIO")
    found.data["c"]["b"][0] = 7
    assert found.data == {"a": {"b": [1, 2]}, "c": {"b": [7, 2]}, "d": {"e": 3, "b": [1, 2]}}
    assert found.where(("c", "b", 1)) == "s.yaml, line 1" and found.where(("d", "e")) == "s.yaml, line 3"
