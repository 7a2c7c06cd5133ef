"""What happens in a run of a link command: a few events, and how it ends."""

import contextlib
import random
import signal
import socket
from typing import NamedTuple

from soak.links.scenario import PERIOD

LINKS = ("run", "mavlink-rc", "mavlink-servo", "ros2", "ardupilot")

# One wrong measurement: what is added to it, or stands in its place.
WILD = (
    "position +1e5 m",
    "position +100 m",
    "position +5 m",
    "position +0.9 m",
    "position nan",
    "velocity +9e5 m/s",
    "velocity +9 m/s",
    "velocity 3e38 m/s",
    "velocity inf",
    "rates +15 rad/s",
    "heading +3 rad",
    "attitude zero",
)

# What somebody sends, or does not send, for a while.
STREAMS = (
    "silence",
    "reordered",
    "replayed",
    "old only",
    "late",
    "garbage",
    "other version",
    "another sender",
    "clock set",
)

ENDINGS = ("INT", "TERM", "HUP", "QUIT", "KILL", "stop", "silence", "INT, TERM")
_ENDING_WEIGHTS = (8, 8, 8, 8, 1, 1, 8, 4)

STATED = {"KILL": 1.0, "stop": 1.5, "silence": 1.5}  # s from the end to neutral commands; others 1 s
CODES = {"INT": (130,), "TERM": (143,), "HUP": (129,), "QUIT": (131,), "INT, TERM": (130, 143), "silence": (1, 143)}

_FIRST, _LAST = 10, 30  # steps after which events begin, and the run ends


class Event(NamedTuple):
    """One thing that happens.

    Attributes:
        kind: "wild", "stall" (SIGSTOP, then SIGCONT), or one of `STREAMS`.
        what: of a wild measurement, one of `WILD`.
        first: step of its beginning.
        steps: how long it lasts.
    """

    kind: str
    what: str
    first: int
    steps: int

    def covers(self, step: int) -> bool:
        """Whether it is happening in a step."""
        return self.first <= step < self.first + self.steps

    def __str__(self) -> str:
        lasts = "" if self.kind == "wild" else f" for {self.steps * PERIOD:g} s"
        return f"{self.kind} {self.what}".strip() + f" at {self.first * PERIOD:g} s" + lasts


class Plan(NamedTuple):
    """What happens in a run.

    Attributes:
        identity: links/LINK/SEED/NUMBER.
        events: in the order of their beginnings.
        ending: one of `ENDINGS`.
        last: step of the ending.
        disk: bytes that a file may grow to; None for any.
        seed: of what is random inside.
    """

    identity: str
    events: tuple[Event, ...]
    ending: str
    last: int
    disk: int | None
    seed: str

    @property
    def link(self) -> str:
        """One of `LINKS`."""
        return self.identity.split("/")[1]

    @property
    def is_single(self) -> bool:
        """Whether at most one message is wrong: then nothing may give full thrust for long."""
        return sum(event.kind == "wild" for event in self.events) <= 1 and not any(
            event.kind in STREAMS for event in self.events
        )

    def __str__(self) -> str:
        disk = [] if self.disk is None else [f"files up to {self.disk} bytes"]
        return "; ".join([*disk, *map(str, self.events), f"{self.ending} at {self.last * PERIOD:g} s"])


def plan(link: str, seed: int, number: int) -> Plan:
    """The plan of a run; number 0 is undisturbed."""
    identity = f"links/{link}/{seed}/{number}"
    chance = random.Random(identity)
    last = chance.randint(_FIRST + 10, _LAST)
    if number == 0:
        return Plan(identity, (), "INT", _LAST, None, identity)
    events = [_event(chance, last) for _ in range(chance.choice((0, 1, 1, 1, 2, 3)))]
    ending = chance.choices(ENDINGS, _ENDING_WEIGHTS)[0]
    disk = chance.choice((2_000, 20_000, 60_000)) if chance.random() < 0.15 else None
    return Plan(identity, tuple(sorted(events, key=lambda event: event.first)), ending, last, disk, identity)


def free_port() -> int:
    """A UDP port that nobody uses, and that the system gives nobody: below those that it hands out."""
    while True:
        port = random.SystemRandom().randrange(10_000, 30_000)
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe, contextlib.suppress(OSError):
            probe.bind(("127.0.0.1", port))
            return port


def signals_of(ending: str) -> list[int]:
    """Numbers of the signals of an ending, in their order."""
    names = {"stop": ["STOP"], "silence": []}.get(ending, ending.split(", "))
    return [int(getattr(signal, f"SIG{name}")) for name in names]


def _event(chance: random.Random, last: int) -> Event:
    kind = chance.choices(("wild", "stall", "stream"), (5, 2, 4))[0]
    first = chance.randint(_FIRST, last - 3)
    if kind == "wild":
        return Event("wild", chance.choice(WILD), first, 1)
    if kind == "stall":
        return Event("stall", "", first, chance.choice((1, 3, 5, 6, 15)))
    return Event(chance.choice(STREAMS), "", first, chance.choice((1, 2, 4, 8, 15)))
