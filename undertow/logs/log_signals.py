"""The signals of a log: named time series with units, and how evenly they were sampled."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

from undertow.core.errors import BadInput, nearest
from undertow.logs.known_signals import SIGNALS

# Median intervals from which on the time between two samples is a gap.
_GAP = 5.0


class Series(NamedTuple):
    """Samples of one signal.

    Attributes:
        time: s, increasing, shape (rows,).
        values: shape (rows,) of a number, (rows, columns) of a vector, or (rows, columns, ...). NaN: not measured.
        columns: names of the columns; () of a number.
        unit: of the values; those of the columns, separated by commas, where they differ.
        meaning: in words.
        origin: topic and columns of the file, with their unit, where the values were converted.
    """

    time: np.ndarray
    values: np.ndarray
    columns: tuple[str, ...] = ()
    unit: str = "1"
    meaning: str = ""
    origin: str = ""

    def column_names(self) -> list[str]:
        """Names of all numbers of one sample: `north`, or `north.3` for the third number that belongs to it."""
        shape = self.values.shape[1:]
        if not shape:
            return [""]
        names = self.columns if len(self.columns) == shape[0] else tuple(str(i + 1) for i in range(shape[0]))
        inner = int(np.prod(shape[1:]))
        return [name if len(shape) == 1 else f"{name}.{i + 1}" for name in names for i in range(inner)]

    def flat(self) -> np.ndarray:
        """Values as a matrix, one row per sample."""
        return self.values.reshape(len(self.time), -1)


class SamplingStatistics(NamedTuple):
    """How a signal was sampled.

    Attributes:
        samples: number.
        start, end: first and last time, s.
        rate: of the median interval, Hz; NaN for a single sample.
        gaps: intervals of more than five median ones.
        longest_gap: the longest of these, s; 0 without one.
        missing: share of the numbers that are NaN.
    """

    samples: int
    start: float
    end: float
    rate: float
    gaps: int
    longest_gap: float
    missing: float


@dataclass(frozen=True)
class LogSignals:
    """Named time series in the frames and units of undertow, and where they come from.

    Attributes:
        signals: by name; see `undertow.logs.known_signals` for the names of what other programs measure. A run of
            undertow has those of its result file.
        source: the file.
        format: `undertow`, `CSV`, `MCAP`, `ROS 1 bag`, `ROS 2 bag`, `ArduPilot`, `MAVLink` or `PX4`.
        notes: what a reader should know: a file without its end, samples left out, frames converted.
        facts: further text by name, such as the scenario of a run.
    """

    signals: Mapping[str, Series]
    source: str
    format: str
    notes: tuple[str, ...] = ()
    facts: Mapping[str, str] = field(default_factory=dict)

    def __post_init__(self):
        for name, series in self.signals.items():
            check_times(name, series.time, self.source)

    def __getitem__(self, name: str) -> Series:
        if name not in self.signals:
            raise missing(self, name)
        return self.signals[name]

    def __contains__(self, name: object) -> bool:
        return name in self.signals

    def sampling(self, name: str) -> SamplingStatistics:
        """How a signal was sampled."""
        series = self[name]
        time = series.time
        steps = np.diff(series.time)
        median = float(np.median(steps)) if steps.size else np.nan
        gaps = steps[steps > _GAP * median]
        numbers = np.asarray(series.values, dtype=float)
        return SamplingStatistics(
            samples=len(time),
            start=float(time[0]) if len(time) else np.nan,
            end=float(time[-1]) if len(time) else np.nan,
            rate=1 / median,
            gaps=len(gaps),
            longest_gap=float(gaps.max()) if len(gaps) else 0.0,
            missing=float(np.isnan(numbers).mean()) if numbers.size else 0.0,
        )

    def duration(self) -> float:
        """Time from the first sample of any signal to the last, s."""
        ends = [
            time for series in self.signals.values() if len(series.time) for time in (series.time[0], series.time[-1])
        ]
        return float(max(ends) - min(ends)) if ends else 0.0

    def __repr__(self) -> str:
        lines = [f"Log of {self.source} ({self.format}), {self.duration():g} s"]
        for name, series in self.signals.items():
            sampling = self.sampling(name)
            lines.append(f"  {name:<20}{sampling.samples:>8} samples {sampling.rate:>8.4g} Hz  {series.unit}")
        return "\n".join([*lines, *(f"  {note}" for note in self.notes)])


def missing(log: LogSignals, *names: str, hint: str = "") -> BadInput:
    """The error for a log that lacks a signal, which may have any of these names.

    Args:
        log: without the signal.
        names: of the signal, the usual one first.
        hint: the remedy; "" for the one that follows from the usual name.
    """
    must = f"have the signal {' or '.join(f'`{name}`' for name in names)}"
    got = f"{log.source}, which has {', '.join(log.signals) or 'none'}"
    return BadInput("log", must, got, hint=hint or _how_to_add(log, names[0]))


def _how_to_add(log: LogSignals, name: str) -> str:
    """How a log comes to have a signal: by a mapping, unless undertow wrote it, or the name means nothing."""
    if name not in SIGNALS or log.format == "undertow":
        return nearest(name, log.signals)
    signal = SIGNALS[name]
    return mapping_hint(log, name, ", ".join(signal.columns) or name, f"unit: {signal.unit}")


def mapping_hint(log: LogSignals, name: str, columns: str, how: str, topic: str = "TOPIC") -> str:
    """Sentence with a mapping that gives a log a signal, from columns of the file if any; a CSV file has no topics."""
    where = "" if log.format == "CSV" or not columns else f"topic: {topic}, "
    entry = f"`signals: {{{name}: {{{where}{f'columns: [{columns}], ' if columns else ''}{how}}}}}`"
    source = ", by the file's own columns" if columns else ""
    return f"Add it to the mapping with which the file is read, or was converted{source}: {entry}"


def check_times(name: str, time: np.ndarray, source: str) -> None:
    """Check that times are finite and increase.

    Raises:
        BadInput: they do not.
    """
    if not np.isfinite(time).all():
        row = int(np.argmin(np.isfinite(time)))
        raise BadInput("log", "have finite times", f"{source}, {name}, sample {row + 1}: {time[row]:g}")
    not_increasing = np.diff(time) <= 0
    if not_increasing.any():
        row = int(np.argmax(not_increasing)) + 1
        got = f"{source}, {name}, sample {row + 1}: {time[row]:.9g} s after {time[row - 1]:.9g} s"
        raise BadInput("log", "have increasing times", got)
