"""Statistics of a real-time loop, in memory that does not grow."""

from typing import Any

import numpy as np

# Intervals of the histogram: from a tenth of a microsecond on, each 1 % longer than the last, up to 1,000 s.
_SHORTEST, _RATIO, _LONGEST = 1e-7, 1.01, 1e3
_INTERVALS = int(np.ceil(np.log(_LONGEST / _SHORTEST) / np.log(_RATIO)))

_ROUNDING = 1e-9  # of the rank of a quantile

_SHARES = {"p50": 0.5, "p99": 0.99, "p99.9": 0.999}


class Durations:
    """Any number of durations, as a histogram with intervals of 1 %, and their exact mean and extremes."""

    def __init__(self) -> None:
        self._counts = np.zeros(_INTERVALS + 1, dtype=np.int64)
        self._sum = self._square = 0.0
        self._least = np.inf
        self._largest = -np.inf
        self.number = 0

    def add(self, duration: float) -> None:
        """Note one duration, s; a negative one counts as zero in the histogram."""
        interval = np.log(max(duration, _SHORTEST) / _SHORTEST) / np.log(_RATIO)
        self._counts[min(int(interval), _INTERVALS)] += 1
        self._sum += duration
        self._square += duration**2
        self._least, self._largest = min(self._least, duration), max(self._largest, duration)
        self.number += 1

    def quantile(self, share: float) -> float:
        """The duration, s, below which a share of them is, to 1 %; NaN without one."""
        if not self.number:
            return np.nan
        rank = np.ceil(share * self.number - _ROUNDING)
        interval = int(np.searchsorted(np.cumsum(self._counts), rank))
        if interval in (0, _INTERVALS):  # below the first interval or above the last
            return self._largest if interval else max(self._least, 0.0)
        return float(np.clip(_SHORTEST * _RATIO ** (interval + 0.5), self._least, self._largest))

    def summary(self) -> dict[str, float]:
        """Number, mean, rms, p50, p99, p99.9 and maximum; times in s; {} without one."""
        if not self.number:
            return {}
        statistics = {
            "number": self.number,
            "mean": self._sum / self.number,
            "rms": (self._square / self.number) ** 0.5,
        }
        return statistics | {name: self.quantile(share) for name, share in _SHARES.items()} | {"max": self._largest}

    def milliseconds(self) -> dict[str, float]:
        """Median, 99th percentile and longest, ms; {} without one."""
        statistics = self.summary()
        return {name: 1e3 * statistics[name] for name in ("p50", "p99", "max")} if statistics else {}

    def __str__(self) -> str:
        return ", ".join(f"{name} {value:.2f} ms" for name, value in self.milliseconds().items()) or "no step yet"


class LoopStatistics:
    """What a real-time loop did.

    Attributes:
        steps: control steps, each with one command.
        overruns: steps whose command came after the deadline.
        missed: periods without a command.
        stale: steps without a new measurement.
        longest_stale: longest time without one, s.
        lateness: of the beginnings of steps after the instants for which they were planned.
        jitter: departures of the time between the beginnings of two successive steps from the period, absolute values;
            of steps between which no period was missed.
        computing: times from the measurement to the command.
    """

    def __init__(self) -> None:
        self.steps = self.overruns = self.missed = self.stale = 0
        self.longest_stale = 0.0
        self.lateness, self.jitter, self.computing = Durations(), Durations(), Durations()

    def as_data(self) -> dict[str, Any]:
        """Everything as numbers, for JSON; times in s."""
        counts = {name: getattr(self, name) for name in ("steps", "overruns", "missed", "stale", "longest_stale")}
        times = {name: getattr(self, name).summary() for name in ("lateness", "jitter", "computing")}
        return counts | times
