import functools
from typing import NamedTuple

import pytest
import typer

from undertow.cli.main import run
from undertow.report import run_page
from undertow.report.figures import run_files, writing

BLANK = '<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 1 1"></svg>'


class Said(NamedTuple):
    code: int
    out: str
    err: str


@pytest.fixture(scope="session", autouse=True)
def commands_are_built_once():
    """Typer builds every command anew at each call, a third of the time of a refusal; they do not change."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(typer.main, "get_command", functools.cache(typer.main.get_command))
        yield


@pytest.fixture
def whole_figures():
    """For tests that look at figures and at the replay: making them takes most of the time of a short run."""


@pytest.fixture
def undertow(tmp_path, monkeypatch, capsys, request):
    """Run the command line in an empty folder, in this process; without a prediction unless it is asked for.

    Figures are made, but blank ones are written unless a test has the fixture `whole_figures`.
    """
    monkeypatch.chdir(tmp_path)
    if "whole_figures" not in request.fixturenames:
        monkeypatch.setattr(writing, "svg", lambda figure: BLANK)
        monkeypatch.setattr(writing, "png", lambda figure: b"blank")
        monkeypatch.setattr(run_files, "small_png", lambda figure: b"blank")
        monkeypatch.setattr(run_page, "replay_of", lambda *_: None)
    monkeypatch.delenv("UNDERTOW_TRACEBACK", raising=False)

    def call(*arguments: str) -> Said:
        if "simulate" in arguments and "--prediction" not in arguments:
            command = arguments.index("simulate") + 1
            arguments = (*arguments[:command], "--no-prediction", *arguments[command:])
        code = run(arguments)
        captured = capsys.readouterr()
        return Said(code, captured.out, captured.err)

    return call


@pytest.fixture
def refused(undertow, tmp_path):
    """Run the command line on bad input: exit code 2, one line, nothing left behind. Returns the complaint."""

    def call(*arguments: str) -> str:
        before = sorted(tmp_path.rglob("*"))
        said = undertow(*arguments)
        assert said.code == 2, said
        assert said.err.startswith("Error: ") and said.err.count("\n") == 1, said.err
        assert "Traceback" not in said.out + said.err
        assert [path for path in sorted(tmp_path.rglob("*")) if "__pycache__" not in str(path)] == before
        return said.err.removeprefix("Error: ").rstrip("\n")

    return call
