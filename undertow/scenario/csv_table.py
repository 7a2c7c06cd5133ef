"""Samples from a CSV file with the columns t, d1, d2, ..."""

import csv
import math
from pathlib import Path

import numpy as np

from undertow.core.errors import BadInput
from undertow.core.number_text import number_in


def read_samples(path: str | Path) -> list[list[float]]:
    """Rows (t, d1, d2, ...) of a CSV file; t in s, increasing.

    Args:
        path: of the file; header `t,d1,d2,...`, at least two rows.

    Raises:
        BadInput: missing, empty or malformed file, or times that do not increase.
    """
    return samples_of(read_csv(path), Path(path).name)


def read_csv(path: str | Path) -> str:
    """Text of a CSV file.

    Raises:
        BadInput: missing or unreadable file.
    """
    path = Path(path)
    if not path.is_file():
        raise BadInput("file", "be an existing CSV file", str(path))
    try:
        return path.read_text(encoding="utf-8-sig")
    except (UnicodeDecodeError, OSError) as error:
        raise BadInput("file", "be a CSV text file", f"{path.name}: {error}") from None


def samples_of(text: str, name: str) -> list[list[float]]:
    """Rows (t, d1, d2, ...) of CSV text; `name` stands for it in messages.

    Raises:
        BadInput: empty or malformed text, or times that do not increase.
    """
    try:
        rows = [[cell.strip() for cell in row] for row in csv.reader(text.splitlines())]
    except csv.Error as error:
        raise BadInput("file", "be a CSV text file", f"{name}: {error}") from None
    numbered = [(line, row) for line, row in enumerate(rows, start=1) if any(row)]
    if not numbered:
        raise BadInput("file", "have a header and at least two rows", f"{name}, which is empty")
    header = numbered[0][1]
    if len(header) < 2 or header != ["t", *(f"d{i}" for i in range(1, len(header)))]:
        hint = "Separate the columns with commas, and write decimal points" if len(header) < 2 else ""
        raise BadInput("file", "have the columns t, d1, d2, ...", f"{name} with columns {', '.join(header)}", hint=hint)
    if len(numbered) < 3:
        raise BadInput("file", "have at least two rows of samples", f"{name} with {len(numbered) - 1}")
    samples = [_numbers(name, line, row, len(header)) for line, row in numbered[1:]]
    for (line, _), before, after in zip(numbered[2:], samples, samples[1:], strict=False):
        if not after[0] > before[0]:
            raise BadInput("file", "have increasing times", f"{name}, line {line}: {after[0]:g} after {before[0]:g}")
    return samples


def csv_of(rows: np.ndarray) -> str:
    """CSV text with the columns t, d1, d2, ..., whose numbers read back as the same."""
    header = ",".join(["t", *(f"d{i}" for i in range(1, rows.shape[1]))])
    return "\n".join([header, *(",".join(map(repr, row)) for row in rows.tolist())]) + "\n"


def _numbers(name: str, line: int, row: list[str], columns: int) -> list[float]:
    if len(row) != columns:
        raise BadInput("file", f"have {columns} columns in every row", f"{name}, line {line} with {len(row)}")
    try:
        numbers = [number_in(cell) for cell in row]
    except ValueError:
        raise BadInput("file", "hold numbers only", f"{name}, line {line}: {', '.join(row)}") from None
    if not all(map(math.isfinite, numbers)):
        raise BadInput("file", "hold finite numbers only", f"{name}, line {line}: {', '.join(row)}")
    return numbers
