"""Clocks of the real-time loop: the machine's, and one that is simulated."""

import abc
import time


class AbstractLoopClock(abc.ABC):
    """Tells the time, and waits. The loop knows no other clock."""

    @abc.abstractmethod
    def now(self) -> float:
        """Time, s, from any origin; it never goes back."""

    @abc.abstractmethod
    def sleep_until(self, instant: float) -> None:
        """Return at an instant, s, or a little later; at once where it has passed."""


class MonotonicClock(AbstractLoopClock):
    """The monotonic clock of this machine, which nobody sets."""

    def now(self) -> float:
        return time.monotonic()

    def sleep_until(self, instant: float) -> None:
        left = instant - time.monotonic()
        if left > 0:
            time.sleep(left)


class SimulatedClock(AbstractLoopClock):
    """A clock that stands still while others compute, and jumps to the instant that is waited for."""

    def __init__(self) -> None:
        self._now = 0.0

    def now(self) -> float:
        return self._now

    def sleep_until(self, instant: float) -> None:
        self._now = max(self._now, instant)
