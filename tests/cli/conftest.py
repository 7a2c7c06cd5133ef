from typing import NamedTuple

import pytest

from undertow.cli.main import run


class Said(NamedTuple):
    code: int
    out: str
    err: str


@pytest.fixture
def undertow(tmp_path, monkeypatch, capsys):
    """Run the command line in an empty folder, in this process; runs without a prediction unless it is asked for."""
    monkeypatch.chdir(tmp_path)
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
