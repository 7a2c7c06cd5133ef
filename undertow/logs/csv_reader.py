"""CSV files: those with any header, as a table; those that `write_csv` wrote, as the log that they were.

The header of ours is `time [s]`, then `signal.column [unit]` for each number. Signals that were sampled at other times
leave their cells empty. Lines end in CR LF, so that one that was cut off is known.
"""

import csv
import re
from collections import Counter
from pathlib import Path

import numpy as np

from undertow.core.errors import BadInput
from undertow.core.number_text import number_in
from undertow.logs.csv_writer import TIME
from undertow.logs.log import Log
from undertow.logs.log_signals import Series
from undertow.logs.recording import Recording, TopicMessages

_WORDS = {"true": 1.0, "false": 0.0, "": np.nan}
_OURS = re.compile(r"(?P<signal>[a-z_0-9]+)(?:\.(?P<column>[^\[\]]+))? \[(?P<unit>[^\[\]]*)\]")


def read_csv(path: Path) -> Log | Recording:
    """What a file holds: a log where `write_csv` wrote it, otherwise one table of its columns.

    Raises:
        BadInput: not text, without rows, rows of different length, or cells of ours that are no numbers.
    """
    header, numbers, empty, texts, notes = _read(path)
    if header[0] == TIME and all(_OURS.fullmatch(name) for name in header[1:]):
        if texts:
            raise BadInput("log", "hold numbers", next(iter(texts.values())))
        return _our_log(path, header, numbers, empty, notes)
    fields = {name: numbers[:, i] for i, name in enumerate(header) if name not in texts}
    table = TopicMessages(np.arange(len(numbers), dtype=float), fields, texts=texts)
    left_out = (f"columns of text are left out: {', '.join(texts)}",) if texts else ()
    return Recording({"": table}, path.name, "CSV", left_out)


def _our_log(path: Path, header: list[str], numbers: np.ndarray, empty: np.ndarray, notes: tuple[str, ...]) -> Log:
    times = numbers[:, 0]
    columns_by_signal = {}
    for i, name in enumerate(header[1:], start=1):
        match = _OURS.fullmatch(name)
        assert match is not None, "`read_csv` has looked"
        columns_by_signal.setdefault((match["signal"], match["unit"]), []).append((match["column"] or "", i))
    signals = {}
    for (name, unit), columns in columns_by_signal.items():
        titles, indices = (tuple(part) for part in zip(*columns, strict=True))
        has_values = ~empty[:, list(indices)].all(axis=1)
        values = numbers[np.ix_(has_values, indices)]
        is_scalar = titles == ("",)
        signals[name] = Series(
            times[has_values], values[:, 0] if is_scalar else values, () if is_scalar else titles, unit
        )
    return Log(signals, path.name, "CSV", notes)


def _read(path: Path) -> tuple[list[str], np.ndarray, np.ndarray, dict[str, str], tuple[str, ...]]:
    """Header, numbers, which cells are empty, the first cell of columns that hold text, and notes."""
    try:
        text = path.read_bytes().decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise BadInput("log", "be a CSV text file", f"{path.name}: {error.reason} at byte {error.start}") from None
    lines = text.splitlines()
    notes = ()
    if text.startswith(TIME) and "\r\n" in text and not text.endswith(("\r", "\n")):
        lines, notes = lines[:-1], (f"the file ends early, within line {len(lines)}, which is left out",)
    try:
        rows = list(csv.reader(lines, delimiter=_delimiter(text)))
    except csv.Error as error:
        raise BadInput("log", "be a CSV text file", f"{path.name}: {error}") from None
    numbered = [
        (line, [cell.strip() for cell in row]) for line, row in enumerate(rows, start=1) if any(map(str.strip, row))
    ]
    if len(numbered) < 2:
        raise BadInput("log", "have a header and at least one row", f"{path.name} with {len(numbered)} rows")
    header = numbered[0][1]
    repeated_name, times = Counter(header).most_common(1)[0]
    if times > 1:
        raise BadInput(
            "log", "have columns of different names", f"{path.name}, where `{repeated_name}` occurs {times} times"
        )
    texts: dict[str, str] = {}
    numbers = np.array([_numbers(path.name, line, row, header, texts) for line, row in numbered[1:]])
    return header, numbers, np.array([[not cell for cell in row] for _, row in numbered[1:]]), texts, notes


def _delimiter(text: str) -> str:
    """The one of comma, semicolon and tabulator that the header has most often."""
    first = next((line for line in text.splitlines() if line.strip()), "")
    return max(",;\t", key=first.count)


def _numbers(name: str, line: int, row: list[str], header: list[str], texts: dict[str, str]) -> list[float]:
    """Numbers of a row, NaN where a cell is empty or text; the first text of each column is added to `texts`."""
    if len(row) != len(header):
        raise BadInput("log", f"have {len(header)} cells in every row", f"{name}, line {line} with {len(row)}")
    values = []
    for title, cell in zip(header, row, strict=True):
        try:
            values.append(_WORDS[cell.lower()] if cell.lower() in _WORDS else number_in(cell))
        except ValueError:
            remedy = ", which needs a decimal point" if cell.replace(",", "").isdecimal() else ""
            texts.setdefault(title, f"{name}, line {line}, column {title}: {cell}{remedy}")
            values.append(np.nan)
    return values
