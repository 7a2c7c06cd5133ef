"""Whether a message is of the present, by the clock of its sender: a queue, a replay or a router may bring old ones."""

_SETTLES = 0.5  # s for which times of another clock have to go on before the clock counts as set
_FOLLOWS = 2.0  # s, time constant with which a larger offset becomes the usual one: a simulation may run slowly
_STEADY = 0.1  # s by which, beyond half of the time that passed, the offset of a clock that was set may wander


class SenderClock:
    """The clock of a sender, whose usual offset from ours is known from its earlier messages.

    Args:
        longest: s by which a message may be older than those before it.

    Attributes:
        jumps: how often the clock was set.
    """

    def __init__(self, longest: float):
        self._longest, self.jumps = longest, 0
        self._newest: float | None = None  # s, time of the newest message by the sender's clock
        self._offset = self._at = 0.0  # s, ours less the sender's, and when it was looked at
        self._other_offset: tuple[float, float] | None = None  # since when there is another offset, and that

    def objection(self, time: float, now: float) -> str:
        """Why a message is not used; "" where it is of the present.

        Args:
            time: of the message, s, by the clock of its sender.
            now: s, by ours, which never jumps.
        """
        offset = now - time
        if self._newest is None:
            self._accept(time, offset, now)
            return ""
        if time == self._newest:
            return "repeated"
        if abs(offset - self._offset) > self._longest:
            if not self._has_settled(offset, now):
                return "old"
            self.jumps += 1
            self._accept(time, offset, now)
            return ""
        if time < self._newest:
            return "out of order"
        if offset > self._offset:
            offset = self._offset + (offset - self._offset) * min(1.0, (now - self._at) / _FOLLOWS)
        self._accept(time, offset, now)
        return ""

    def _has_settled(self, offset: float, now: float) -> bool:
        """Whether another offset has gone on for long enough; that of a message that comes again and again grows."""
        if self._other_offset is not None:
            since, first = self._other_offset
            elapsed = now - since
            if abs(offset - first) <= 0.5 * elapsed + _STEADY:
                return elapsed >= _SETTLES
        self._other_offset = now, offset
        return False

    def _accept(self, time: float, offset: float, now: float) -> None:
        self._newest, self._offset, self._at, self._other_offset = time, offset, now, None
