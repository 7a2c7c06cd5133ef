"""`undertow logs`: what is in a log, conversion to MCAP or CSV, and a layout for Foxglove."""

from collections.abc import Sequence
from datetime import UTC, datetime
from pathlib import Path

from rich.console import Console

from undertow.cli.exit_codes import DONE
from undertow.cli.options.logs import LogsCommand
from undertow.cli.tables import numbers, titled, wide_console
from undertow.core.atomic_io import write_whole
from undertow.core.errors import BadInput
from undertow.logs.foxglove_layout import layout as foxglove_layout
from undertow.logs.log import Log
from undertow.scenario.log_file import read_log

_LAYOUT = Path("undertow-foxglove.json")
_NUMBERS = ("samples", "rate, Hz", "from, s", "to, s", "gaps", "longest, s", "missing")
_SHOWN = 3  # names of columns
_LONG = 1e5  # s; longer times are those of a clock
_UNIX = (9e8, 4.1e9)  # s since 1970, from 1998 to 2099


def logs(command: LogsCommand) -> int:
    """Show what is in a file, and convert it if `out` is given; return the exit code."""
    first, *further_words = command.words
    check_words(further_words, 0, "FILE")
    path, out = Path(first), command.out
    if out is not None:
        _check_new(out, (".mcap", ".csv"), command.overwrite)
        if out.exists() and path.exists() and out.samefile(path):
            raise BadInput("--out", "be another file than the log itself", str(out))
    log = read_log(path, command.mapping)
    console = wide_console()
    _print(log, console)
    if out is not None:
        log.save(out)
        console.print(f"Written: {out}", highlight=False, soft_wrap=True)
    return DONE


def layout(command: LogsCommand) -> int:
    """Write a layout for Foxglove; return the exit code."""
    check_words(command.words[1:], 0, "layout")
    out = command.out or _LAYOUT
    _check_new(out, (".json",), command.overwrite)
    write_whole(out, foxglove_layout())
    wide_console().print(f"Layout for Foxglove: {out}", highlight=False, soft_wrap=True)
    return DONE


def check_words(words: Sequence[str], number: int, form: str) -> None:
    """Check the number of words after the first.

    Raises:
        BadInput: it is another one than the form of the command has.
    """
    if len(words) != number:
        raise BadInput("logs", f"be followed by {form}", f"with {len(words)} words after the first")


def _check_new(out: Path, suffixes: tuple[str, ...], overwrite: bool) -> None:
    if out.suffix not in suffixes:
        raise BadInput("--out", f"be a file whose name ends in {' or '.join(suffixes)}", str(out))
    if not out.parent.is_dir():
        raise BadInput("--out", "be in an existing folder", str(out))
    if out.exists() and not overwrite:
        raise BadInput("--out", "be a new file", f"{out}, which exists", hint="Add --overwrite to replace it")


def _print(log: Log, console: Console) -> None:
    """Signals, how they were sampled, and where they come from."""
    title = f"{log.source}: {log.format}, {len(log.signals)} signals, {log.duration():.6g} s"
    rows = [_row(log, name) for name in log.signals]
    heads = ("signal", "columns", "unit", *map(numbers, _NUMBERS), "taken from")
    used_columns = [i for i in range(len(heads)) if any(row[i] for row in rows)]  # most logs have no gaps
    table = titled(title, *(heads[i] for i in used_columns))
    for row in rows:
        table.add_row(*(row[i] for i in used_columns))
    console.print(table)
    console.print("World axes are north, east, down; body axes forward, starboard, down.", highlight=False)
    if dates := _dates(log):
        console.print(dates, highlight=False)
    for note in log.notes:
        console.print(f"Note: {note}.", highlight=False, soft_wrap=True)


def _row(log: Log, name: str) -> tuple[str, ...]:
    series, how = log[name], log.sampling(name)
    names = series.column_names()
    columns = ", ".join(names) if len(names) <= _SHOWN else f"{names[0]}, ..., {names[-1]} ({len(names)})"
    times = _clock(how.start), _clock(how.end)
    gaps = (str(how.gaps), f"{how.longest_gap:.3g}") if how.gaps else ("", "")
    missing = f"{100 * how.missing:.3g} %" if how.missing else ""
    return name, columns, series.unit, str(how.samples), f"{how.rate:.4g}", *times, *gaps, missing, series.origin


def _clock(seconds: float) -> str:
    """A time in s. Six digits tell no two Unix times apart, and so these have milliseconds."""
    return f"{seconds:.6g}" if abs(seconds) < _LONG else f"{seconds:.3f}"


def _dates(log: Log) -> str:
    """The dates of the first and last sample, where times seem to be seconds since 1970; "" otherwise."""
    ends = [time for series in log.signals.values() if len(series.time) for time in (series.time[0], series.time[-1])]
    if not ends or not _UNIX[0] < min(ends) <= max(ends) < _UNIX[1]:
        return ""
    first, last = (datetime.fromtimestamp(time, UTC) for time in (min(ends), max(ends)))
    return f"As seconds since 1970, times are from {first:%Y-%m-%d %H:%M:%S} to {last:%Y-%m-%d %H:%M:%S} UTC."
