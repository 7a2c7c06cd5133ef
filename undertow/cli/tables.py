"""Tables and console of the terminal."""

from collections.abc import Iterable
from typing import Any

from rich.console import Console
from rich.table import Column, Table
from rich.text import Text

from undertow.report.run_tables import WORDS, RunTable, plain


def titled(title: str, *columns: str | Column) -> Table:
    """An empty table with its title at the left."""
    return Table(*columns, title=title, title_justify="left", title_style="bold")


def numbers(title: str) -> Column:
    """A column of numbers, set to the right."""
    return Column(title, justify="right")


def terminal_table(rows: RunTable) -> Table:
    """A table of a run: names on the left, numbers set to the right, units and sentences as they are."""
    first, *further_heads = rows.head
    table = titled(rows.title, first, *(title if title in WORDS else numbers(title) for title in further_heads))
    for row in rows.rows:
        table.add_row(*map(plain, row))
    if rows.sentences:
        table.caption, table.caption_justify = "\n".join(rows.sentences), "left"
    return table


class _Output(Console):
    """Console on stdout that shows text as it is: names of signals, requirements and folders come from anywhere.

    Brackets are no markup, and characters that act on a terminal are written as escapes. It leaves it to the command
    what happens where nobody reads any more.
    """

    def __init__(self, **options: Any):
        super().__init__(markup=False, emoji=False, **options)

    def render_str(self, text: str, **options: Any) -> Text:
        characters = (
            character if character.isprintable() or character == "\n" else character.encode("unicode_escape").decode()
            for character in text
        )
        return super().render_str("".join(characters), **options)

    def on_broken_pipe(self) -> None:
        raise  # what Rich has caught, and would end the process for


def print_lines(console: Console, lines: Iterable[str]) -> None:
    """Print sentences, each on a line of its own."""
    for line in lines:
        console.print(line, highlight=False, soft_wrap=True)


def wide_console() -> Console:
    """Console on stdout; in a pipe its lines are wide enough for every table."""
    console = _Output(soft_wrap=False)
    return console if console.is_terminal else _Output(width=160)
