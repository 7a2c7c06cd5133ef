"""`undertow check`: report errors and warnings for a vehicle, another part, or a scenario."""

from collections.abc import Sequence
from typing import Any

from rich.text import Text

from undertow.checks import check as checks
from undertow.cli.exit_codes import BAD_INPUT, DONE
from undertow.cli.tables import titled, wide_console
from undertow.core.errors import BadInput
from undertow.scenario.yaml_text import load


def check(thing: str, options: Sequence[str], allow_code: bool) -> int:
    """Print the findings of a check and the derived quantities; return the exit code."""
    report = checks.check(thing, dict(map(_option, options)), allow_code)
    console = wide_console()
    for sentence in report.sentences:
        print(sentence)
    for title, rows in report.tables:
        table = titled(title, "", "value", "unit")
        for row in rows:
            table.add_row(*map(Text, row))
        console.print(table)
    advice = len(report.sentences) - report.errors
    print(f"{thing}: {_counted(report.errors, 'error')}, {_counted(advice, 'piece')} of advice")
    return BAD_INPUT if report.errors else DONE


def _option(text: str) -> tuple[str, Any]:
    """Split KEY=VALUE and read the value as YAML."""
    key, equals, value = text.partition("=")
    if not equals or not key:
        raise BadInput("--option", "be KEY=VALUE", text)
    return key, load(value, "", "--option")[0]


def _counted(number: int, what: str) -> str:
    return f"{number} {what}{'' if number == 1 else 's'}"
