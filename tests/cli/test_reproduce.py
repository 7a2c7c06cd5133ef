"""`undertow reproduce` around the study itself: progress, verdicts, and a folder that appears whole."""

import contextlib
import json

import pytest

from undertow.cli import reproduce as command


@pytest.fixture
def short_study(monkeypatch):
    """A study that takes no time."""

    def short(folder, quick, progress, pool):
        progress("ran something", 0.5)
        (folder / "runs").mkdir()
        claims = [{"id": "C1", "claim": "It converges.", "verdict": f"holds, quick {quick}"}]
        (folder / "results.json").write_text(json.dumps({"claims": claims}))

    def write(found, folder, pdf, pool):
        (folder / "report.html").write_text("page")
        return folder / "report.html"

    monkeypatch.setattr(command, "reproduce_paper", short)
    monkeypatch.setattr(command, "write", write)
    monkeypatch.setattr(command, "worker_processes", lambda preload: contextlib.nullcontext())


def test_progress_verdicts_and_place_of_the_report(undertow, tmp_path, short_study):
    said = undertow("reproduce", "--quick", "--out", "here")
    assert said == (
        0,
        " 50% ran something\n 90% figures and report\nC1  holds, quick True: It converges.\nReport: here/report.html\n",
        "",
    )
    assert sorted(path.name for path in (tmp_path / "here").iterdir()) == ["report.html", "results.json", "runs"]


def test_earlier_reproduction_is_replaced_and_other_files_stay(undertow, tmp_path, short_study):
    assert undertow("reproduce").code == 0
    (tmp_path / "reproduction" / "report.html").write_text("old")
    (tmp_path / "reproduction" / "notes.txt").write_text("mine")
    assert undertow("reproduce").code == 0
    assert (tmp_path / "reproduction" / "report.html").read_text() == "page"
    assert (tmp_path / "reproduction" / "notes.txt").read_text() == "mine"


def test_impossible_folder_is_refused_first(refused, tmp_path):
    (tmp_path / "file").touch()
    assert refused("reproduce", "--out", "file") == "`--out` must be a folder, but is file, a file. Choose another name"


def test_a_report_that_cannot_be_written_costs_no_results(undertow, tmp_path, short_study, monkeypatch):
    def fail(found, folder, pdf, pool):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(command, "write", fail)
    assert undertow("reproduce").code == 4
    assert [path.name for path in tmp_path.iterdir()] == ["reproduction"]
    assert (tmp_path / "reproduction" / "results.json").is_file()
