"""What both nodes have in common: names of topics, a status line once a second, and each trouble said once."""

import time
from collections import Counter
from collections.abc import Callable, Iterable
from typing import NamedTuple

from undertow.core.errors import BadInput, did_you_mean
from undertow.outside.ros2.link import Inlet

QUIET = 10.0  # s, within which a trouble that comes again is only counted
STATUS_PERIOD = 1.0  # s, between status lines
WAIT = 0.1  # s, longest wait for a message: after it Ctrl-C is noticed


class Topics(NamedTuple):
    """Names of the topics of the nodes."""

    odom: str = "/odom"
    target_pose: str = "/target_pose"
    thrusters: str = "/thrusters"
    wrench: str = "/wrench"
    imu: str = "/imu"
    clock: str = "/clock"

    def remapped(self, rules: Iterable[str]) -> "Topics":
        """These names with rules `odom:=/vehicle/odometry` applied, as ROS 2 writes them.

        Raises:
            BadInput: a rule has no `:=`, or names no topic of a node.
        """
        names = self._asdict()
        for rule in rules:
            old, separator, new = rule.partition(":=")
            old = old.removeprefix("/")
            if not separator:
                raise BadInput("--remap", "be of the form odom:=/vehicle/odometry", rule)
            if old not in names:
                raise BadInput("--remap", "name a topic of a node", f"`{old}`", hint=did_you_mean(old, names))
            names[old] = new if new.startswith("/") else f"/{new}"
        return Topics(**names)


class Reporter:
    """Counts what happens and tells about it.

    Args:
        say: prints a line.

    Attributes:
        counts: number of each event.
    """

    def __init__(self, say: Callable[[str], None]):
        self._say = say
        self.counts = Counter[str]()
        self._explained_at: dict[str, float] = {}  # when each was explained last, s
        self._next = time.monotonic() + STATUS_PERIOD

    def say(self, sentence: str) -> None:
        """Print a line."""
        self._say(sentence)

    def warn(self, event: str, sentence: str) -> None:
        """Explain an event, if it is the first one of its kind."""
        if event not in self._explained_at:
            self._explained_at[event] = time.monotonic()
            self._say(f"Warning: {' '.join(sentence.split())}")

    def trouble(self, event: str, sentence: str) -> None:
        """Count an event; the first one of its kind is explained."""
        self.counts[event] += 1
        self.warn(event, sentence)

    def over(self, event: str) -> None:
        """An event has ended: the next one of its kind is explained again, unless it was a short while ago."""
        if time.monotonic() - self._explained_at.get(event, 0.0) > QUIET:
            self._explained_at.pop(event, None)

    def status(self, line: Callable[[], str], only: Inlet | None = None) -> None:
        """Print a status line, if the last one was a second ago; warn where `only` has several publishers."""
        now = time.monotonic()
        if now >= self._next:
            self._next = now + STATUS_PERIOD
            self._say(line())
            if only is not None and (mixed := mixed_publishers(only)):
                self.warn(mixed, mixed)

    def events(self) -> str:
        """The counts as text; empty without any."""
        return "".join(f", {number} {event}" for event, number in sorted(self.counts.items()) if number)


def mixed_publishers(inlet: Inlet) -> str:
    """What is wrong where several publishers send to one subscriber; "" where they do not."""
    count = inlet.publishers()
    if count < 2:
        return ""
    return (
        f"{inlet.topic} has {count} publishers, whose messages are mixed. "
        "End all but one, or give one another topic with --remap"
    )
