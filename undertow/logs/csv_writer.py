"""A log as a CSV file, which `csv_reader` reads back.

The header is `time [s]`, then `signal.column [unit]` for each number. Signals that were sampled at other times leave
their cells empty. Lines end in CR LF, so that one that was cut off is known.
"""

import csv
from pathlib import Path

import numpy as np

from undertow.logs.log_signals import LogSignals

TIME = "time [s]"


def write_csv(log: LogSignals, path: Path) -> None:
    """Write a log to a file. Numbers are written so that they read back as the same; meanings are not kept.

    Args:
        log: with the signals.
        path: of the file, which is replaced.

    Raises:
        OSError: the file cannot be written.
    """
    times = np.unique(np.concatenate([series.time for series in log.signals.values()] or [np.zeros(0)]))
    header = [TIME]
    columns = [[repr(time) for time in times.tolist()]]
    for name, series in log.signals.items():
        rows = np.searchsorted(times, series.time)
        for column, values in zip(series.column_names(), series.flat().T, strict=True):
            header.append(f"{name}{'.' if column else ''}{column} [{series.unit}]")
            cells = [""] * len(times)
            for row, value in zip(rows.tolist(), values.tolist(), strict=True):
                cells[row] = repr(value)
            columns.append(cells)
    with path.open("w", newline="", encoding="utf-8") as stream:
        writer = csv.writer(stream)
        writer.writerow(header)
        writer.writerows(zip(*columns, strict=True))
