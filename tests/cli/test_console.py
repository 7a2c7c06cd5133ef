"""Tables and lines show names as they are, whoever chose them."""

import pytest

from undertow.cli.tables import terminal_table, wide_console
from undertow.report.run_tables import RunTable


@pytest.mark.parametrize("name", ["error [m]", "[/x] ok", "run[bold]", "[link=http://a]b[/link]", ":smile:"])
def test_brackets_are_no_markup(name, capsys):
    console = wide_console()
    console.print(terminal_table(RunTable(name, (name, "unit"), [(name, name)], [])))
    console.print(name)
    assert capsys.readouterr().out.count(name) == 5


def test_terminals_get_no_commands(capsys):
    """A title and a colour in the name of a signal of somebody's log."""
    hostile = "\x1b]0;TITLE\x07 \x1b[31mred\x9b2J\u202e"
    console = wide_console()
    console.print(terminal_table(RunTable("t", ("name", "unit"), [(hostile, "m")], [hostile])))
    console.print(hostile)
    out = capsys.readouterr().out
    assert all(one.isprintable() for line in out.splitlines() for one in line)
    assert out.count(r"\x1b]0;TITLE\x07") == 3
