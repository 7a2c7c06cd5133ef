"""Whether measurements come regularly enough for a law: a few late steps are none, many of them are another law."""

from collections import deque

LATE = 1.5  # sampling times from one measurement to the next, from which on it is late
MOST = 5  # late ones within `WINDOW`, at which measurements count as irregular
WINDOW = 1.0  # s
_SHORTEST = 10  # sampling times that the window has at least


class MeasurementRate:
    """Measurements are irregular from five late ones within a second on, until there was none for a second.

    A law in whose model the sampling time is much shorter than that of its measurements can be unstable.

    Args:
        sampling_time: s.

    Attributes:
        irregular: whether they are, by the last one.
        counted: how often they became so.
    """

    def __init__(self, sampling_time: float):
        self._sampling_time = sampling_time
        self._window = max(WINDOW, _SHORTEST * sampling_time)
        self._late: deque[float] = deque(maxlen=MOST)  # when
        self.irregular, self.counted = False, 0

    def note(self, elapsed: float, now: float) -> None:
        """A measurement that is used has come.

        Args:
            elapsed: since the one before, by the clock of its sender, s.
            now: time of a clock that never jumps, s.
        """
        if elapsed > LATE * self._sampling_time:
            self._late.append(now)
        if self.irregular:
            self.irregular = now - self._late[-1] <= self._window
        elif len(self._late) == MOST and now - self._late[0] <= self._window:
            self.irregular = True
            self.counted += 1
