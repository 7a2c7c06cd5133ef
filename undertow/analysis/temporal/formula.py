"""Formulas of signal temporal logic and their robustness: how far a series is from the boundary of a formula.

A formula has a robustness at every instant of a series: positive where the formula holds, negative where it does not
(Donze and Maler 2010). It is computed for all instants at once, from the leaves to the root; that of a run is the first
entry. The same code computes the exact value with NumPy and a smooth one with JAX, in which the minimum and the
maximum are replaced by their log-sum-exp approximations.
"""

import abc
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

Series = Any  # (..., time): an array of NumPy or JAX
Signals = Mapping[str, Any]  # name -> values, time first


@dataclass(frozen=True)
class Arithmetic:
    """What the robustness of a formula is computed with.

    Attributes:
        numbers: NumPy or jax.numpy.
        minimum: of two arrays, entry by entry; associative, exact or smooth.
        nothing: finite or infinite number above all others, the minimum of nothing.
        backward: scan from the last instant to the first, see `NUMPY`.
    """

    numbers: Any
    minimum: Callable[[Any, Any], Any]
    nothing: float
    backward: Callable[[Callable[[Any, Any, Any], Any], Series, Series, Any], Series]

    def maximum(self, first: Any, second: Any) -> Any:
        """Of two arrays, entry by entry."""
        return -self.minimum(-first, -second)

    def later(self, series: Series, steps: int) -> Series:
        """The series `steps` instants later; beyond its end, what is above all numbers."""
        size = series.shape[-1]
        padding = self.numbers.full((*series.shape[:-1], min(steps, size)), self.nothing)
        return self.numbers.concatenate([series[..., min(steps, size) :], padding], axis=-1)

    def least(self, series: Series, first: int, count: int) -> Series:
        """Smallest of `count` entries from `first` instants after each; what is above all numbers where there are none.

        The window is composed of windows whose sizes are powers of two.
        """
        smallest, offset, power, size = None, first, series, 1
        remaining = min(count, series.shape[-1])
        while remaining:
            if remaining & 1:
                part = self.later(power, offset)
                smallest = part if smallest is None else self.minimum(smallest, part)
                offset += size
            remaining >>= 1
            if remaining:
                power, size = self.minimum(power, self.later(power, size)), 2 * size
        return self.numbers.full(series.shape, self.nothing) if smallest is None else smallest


def _backward(step: Callable[[Any, Any, Any], Any], first: Series, second: Series, start: Any) -> Series:
    """`step` of the result one instant later and the two entries, from the end to the beginning."""
    results, last = np.empty_like(first), np.full(first.shape[:-1], start)
    for k in range(first.shape[-1] - 1, -1, -1):
        results[..., k] = last = step(last, first[..., k], second[..., k])
    return results


NUMPY = Arithmetic(np, np.minimum, np.inf, _backward)
_FAR = 1e9  # above every robustness, and its exponentials have a gradient


def smooth(sharpness: float) -> Arithmetic:
    """Arithmetic of JAX in which the minimum has a gradient everywhere.

    The minimum of n numbers is too small by at most log(n) / sharpness.

    Args:
        sharpness: of the log-sum-exp, per unit of robustness.
    """
    import jax
    import jax.numpy as jnp

    def backward(step, first, second, start):
        def body(last, at):
            value = step(last, *at)
            return value, value

        pairs = (jnp.moveaxis(first, -1, 0), jnp.moveaxis(second, -1, 0))
        values = jax.lax.scan(body, jnp.full(first.shape[:-1], start), pairs, reverse=True)[1]
        return jnp.moveaxis(values, 0, -1)

    least = lambda first, second: -jnp.logaddexp(-sharpness * first, -sharpness * second) / sharpness
    return Arithmetic(jnp, least, _FAR, backward)


@dataclass(frozen=True)
class Interval:
    """Instants from `start` to `stop` after the present, s; infinite to the end of the run."""

    start: float = 0.0
    stop: float = float("inf")

    def window(self, period: float, size: int) -> tuple[int, int]:
        """First record and number of records, of a series of `size` records."""
        first = int(np.ceil(self.start / period - 1e-6))
        last = size - 1 if np.isinf(self.stop) else int(np.floor(self.stop / period + 1e-6))
        return first, max(0, last - first + 1)


class Formula(abc.ABC):
    """A statement about the run from an instant on."""

    @abc.abstractmethod
    def robustness(self, signals: Signals, period: float, by: Arithmetic = NUMPY) -> Series:
        """Robustness at every record.

        Args:
            signals: recorded signals, time first.
            period: between records, s.
            by: exact or smooth arithmetic.
        """

    @abc.abstractmethod
    def horizon(self) -> float:
        """Time of the earliest instant at which the formula says anything, s."""

    @abc.abstractmethod
    def names(self) -> frozenset[str]:
        """Signals that it needs."""


@dataclass(frozen=True)
class Below(Formula):
    """A value of the signals stays below a limit; the robustness is what is left, as a share of the limit.

    Where the limit is zero, the robustness is what is left itself. With `sign` -1 the value has to stay above.
    """

    value: "Value"
    limit: float
    sign: float = 1.0

    def robustness(self, signals, period, by=NUMPY):
        margin = self.sign * (self.limit - self.value.of(signals, period, by.numbers))
        return margin / (abs(self.limit) or 1.0)

    def horizon(self):
        return 0.0

    def names(self):
        return self.value.names()


@dataclass(frozen=True)
class Not(Formula):
    """The formula does not hold."""

    inner: Formula

    def robustness(self, signals, period, by=NUMPY):
        return -self.inner.robustness(signals, period, by)

    def horizon(self):
        return self.inner.horizon()

    def names(self):
        return self.inner.names()


@dataclass(frozen=True)
class Both(Formula):
    """Both formulas hold: the smaller robustness."""

    one: Formula
    other: Formula

    def robustness(self, signals, period, by=NUMPY):
        return by.minimum(self.one.robustness(signals, period, by), self.other.robustness(signals, period, by))

    def horizon(self):
        return max(self.one.horizon(), self.other.horizon())

    def names(self):
        return self.one.names() | self.other.names()


@dataclass(frozen=True)
class Always(Formula):
    """The formula holds at every instant of the interval: the smallest robustness."""

    inner: Formula
    interval: Interval = Interval()

    def robustness(self, signals, period, by=NUMPY):
        inner = self.inner.robustness(signals, period, by)
        return by.least(inner, *self.interval.window(period, inner.shape[-1]))

    def horizon(self):
        return self.interval.start + self.inner.horizon()

    def names(self):
        return self.inner.names()


@dataclass(frozen=True)
class Until(Formula):
    """The second formula holds at an instant of the interval, and the first up to and at that instant.

    Of an interval that begins later, the first formula holds up to its beginning, and from there the unbounded one
    (Donze, Ferrere and Maler 2013, lemma 1).
    """

    first: Formula
    second: Formula
    interval: Interval = Interval()

    def robustness(self, signals, period, by=NUMPY):
        first, second = (formula.robustness(signals, period, by) for formula in (self.first, self.second))
        step = lambda later, holds, comes: by.minimum(holds, by.maximum(comes, later))
        unbounded = by.backward(step, first, second, -by.nothing)
        begin, count = self.interval.window(period, first.shape[-1])
        before = by.least(first, 0, begin + 1)
        comes = -by.least(-second, begin, count)
        inside = by.later(-unbounded, begin)  # beyond the end: not at all
        return by.minimum(by.minimum(before, comes), -inside)

    def horizon(self):
        return self.interval.start + max(self.first.horizon(), self.second.horizon())

    def names(self):
        return self.first.names() | self.second.names()


def either(first: Formula, second: Formula) -> Formula:
    """One of the formulas holds: the larger robustness."""
    return Not(Both(Not(first), Not(second)))


def eventually(inner: Formula, interval: Interval) -> Formula:
    """The formula holds at some instant of the interval: the largest robustness."""
    return Not(Always(Not(inner), interval))


# Functions of the entries of a signal, over the last axis.
REDUCTIONS: dict[str, Callable[[Any, Any], Any]] = {
    "norm": lambda numbers, entries: numbers.sqrt((entries * entries).sum(-1)),
    "largest": lambda numbers, entries: numbers.abs(entries).max(-1),
    "mean": lambda numbers, entries: entries.mean(-1),
}


@dataclass(frozen=True)
class Value:
    """A number at every instant: entries of a signal, a function of them, and a mean over the last seconds.

    Attributes:
        signal: name of a recorded signal.
        entries: which of its entries; None for a signal that is a number.
        reduction: of `REDUCTIONS`; "" for a single entry.
        absolute: whether its absolute value is taken.
        window: s; 0 for the value itself. What lies before the run counts as zero.
    """

    signal: str
    entries: tuple[int, ...] | None = None
    reduction: str = ""
    absolute: bool = False
    window: float = 0.0

    def of(self, signals: Signals, period: float, numbers: Any = np) -> Series:
        """Shape (time,)."""
        signal = numbers.asarray(signals[self.signal], dtype=float)
        if self.reduction:
            selected = signal if self.entries is None else signal[:, np.array(self.entries)]
            values = REDUCTIONS[self.reduction](numbers, selected)
        else:
            values = signal if self.entries is None else signal[:, self.entries[0]]
        values = numbers.abs(values) if self.absolute else values
        if not self.window:
            return values
        count = max(1, round(self.window / period))
        sums = numbers.concatenate([numbers.zeros(count), numbers.cumsum(values)])
        return (sums[count:] - sums[:-count]) / count

    def names(self) -> frozenset[str]:
        """The signal that it needs."""
        return frozenset({self.signal})

    def averaged(self, window: float) -> "Value":
        """The mean over the last `window` seconds."""
        return replace(self, window=window)
