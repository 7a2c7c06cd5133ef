"""`undertow list`: list the available parts."""

from rich.table import Table
from rich.text import Text

from undertow.cli.tables import wide_console
from undertow.core import catalogue
from undertow.core.errors import BadInput, did_you_mean
from undertow.scenario.describing import summary


def list_parts(kind: str | None) -> None:
    """Print the parts of one kind, or of all kinds, with one line each."""
    if kind is not None and kind not in catalogue.KINDS:
        raise BadInput("KIND", "be a kind of part", kind, hint=did_you_mean(kind, catalogue.KINDS))
    table = Table("kind", "name", "description")
    for shown in (kind,) if kind else catalogue.KINDS:
        for name, part in sorted(catalogue.names(shown).items()):
            table.add_row(shown, name, Text(summary(part)))
        table.add_section()
    wide_console().print(table)
