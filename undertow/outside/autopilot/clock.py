"""Time of the steps of a controller: late, missed and repeated ones."""

import numpy as np

from undertow.core.checks import numbers

# Sampling times from which on a step is late, and is missed.
LATE, MISSED = 1.5, 5.0

_NEVER = 1e9  # s: no time between two steps

_COUNTS = ("steps", "late", "missed", "repeated")


class StepClock:
    """Counts steps and tells how much time has passed.

    Args:
        period: sampling time, s.

    Attributes:
        numbers: everything that changes, which may be saved and written again.
    """

    def __init__(self, period: float):
        self._period = period
        self.numbers = np.zeros(2 + len(_COUNTS))  # time of the last irregular step, regular steps since, counts

    def begin(self) -> None:
        """Start again at zero."""
        self.numbers[:] = 0.0

    @property
    def time(self) -> float:
        """s since the start; a multiple of the sampling time where all steps were on time, as in a simulation."""
        return float(self.numbers[0] + self.numbers[1] * self._period)

    @property
    def counts(self) -> dict[str, int]:
        """Steps after the first one, and those of them that were late, missed or repeated."""
        return {name: int(number) for name, number in zip(_COUNTS, self.numbers[2:], strict=True)}

    def passed(self, dt: float | None) -> float:
        """Time by which the law advances now, s; zero where there is nothing to do.

        Args:
            dt: time since the last step, s; None for the sampling time.

        Raises:
            BadInput: it is no number.
        """
        step = self._period if dt is None else float(numbers("dt", dt, ()))
        self._count("steps")
        if not 0 < step < _NEVER:
            self._count("repeated")
            return 0.0
        if step >= LATE * self._period:
            self._count("missed" if step >= MISSED * self._period else "late")
        if step == self._period:
            self.numbers[1] += 1
        else:
            self.numbers[:2] = self.time + step, 0
        return min(step, MISSED * self._period)

    def _count(self, name: str) -> None:
        self.numbers[2 + _COUNTS.index(name)] += 1
