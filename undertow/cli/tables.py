"""What a run did, as a short table."""

from typing import Any

from rich.console import Console
from rich.table import Table

from undertow.analysis.meanings import MEANINGS


def metrics_table(steady: dict[str, Any] | None, whole: dict[str, Any], window: tuple[float, float]) -> Table:
    """Metrics of the steady window beside those of the whole run."""
    table = Table(title="Metrics", title_justify="left", title_style="bold")
    table.add_column("metric")
    table.add_column(f"{window[0]:g} to {window[1]:g} s", justify="right")
    table.add_column("whole run", justify="right")
    table.add_column("unit")
    for name, (_, unit) in MEANINGS.items():
        if name in whole:
            table.add_row(name, _number(steady[name]) if steady else "-", _number(whole[name]), unit)
    return table


def wide_console() -> Console:
    """Console on stdout; in a pipe lines are long enough for every table."""
    console = Console(soft_wrap=False)
    return console if console.is_terminal else Console(width=160)


def _number(value: float) -> str:
    return f"{value:.4g}"
