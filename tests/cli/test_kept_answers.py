"""Answers of `list` and `describe`, which are kept as long as nothing is installed anew."""

import pytest

from undertow.cli import kept_answer
from undertow.cli.kept_answer import print_kept
from undertow.cli.options.describe import DescribeCommand, ListCommand


@pytest.fixture
def asked(tmp_path, monkeypatch, capsys):
    """Ask something; gives what was printed, the exit code, and whether it was computed."""
    monkeypatch.setenv("UNDERTOW_CACHE", str(tmp_path))
    monkeypatch.setattr(kept_answer, "foreign_modules", list)

    def ask(question="list", text="öne part\n", code=None):
        calls = []

        def answer():
            calls.append(question)
            print(text, end="")
            return code

        result = print_kept(question, answer)
        return capsys.readouterr().out, result, bool(calls)

    return ask


def test_computed_once(asked):
    assert asked() == ("öne part\n", None, True)
    assert asked() == ("öne part\n", None, False)
    assert asked("describe", "another\n") == ("another\n", None, True)


def test_failures_are_computed_again(asked):
    for _ in range(2):
        assert asked(code=2) == ("öne part\n", 2, True)


@pytest.mark.parametrize("change", ["width", "colours", "installation"])
def test_what_it_depends_on(asked, monkeypatch, change):
    asked()
    if change == "width":
        monkeypatch.setenv("COLUMNS", "61")
    elif change == "colours":
        monkeypatch.setenv("NO_COLOR", "1")
    else:
        monkeypatch.setattr(kept_answer, "installation", lambda: ("another",))
    assert asked()[2] and not asked()[2]


@pytest.mark.parametrize("who", ["foreign_modules", "_others_have_parts"])
def test_nothing_is_kept_where_others_have_parts(asked, monkeypatch, who):
    monkeypatch.setattr(kept_answer, who, lambda: True)
    assert asked()[2] and asked()[2]


@pytest.mark.parametrize("damage", [b"", b"x" * 40])
def test_damaged_answers_are_computed_again(asked, tmp_path, damage):
    asked()
    (entry,) = (tmp_path / "native").glob("*")
    entry.write_bytes(damage)
    assert asked() == ("öne part\n", None, True)


def test_of_files_nothing_is_kept(tmp_path, monkeypatch):
    """Their contents may change."""
    monkeypatch.chdir(tmp_path)
    assert ListCommand().keeps_answer() and DescribeCommand(name="t200").keeps_answer()
    assert not DescribeCommand(name="./mine.py:part").keeps_answer()
    assert not DescribeCommand(name="my_rov.yaml").keeps_answer()
    (tmp_path / "t200").write_text("")
    assert not DescribeCommand(name="t200").keeps_answer()
