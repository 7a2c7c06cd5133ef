"""What an ablation is made of: variants of one closed loop, and an answer from their numbers."""

from typing import NamedTuple

from undertow.loop.closed_loop import ClosedLoop


class Schedule(NamedTuple):
    """How long and how often; two schedules are two compiled programs."""

    duration: float = 10.0  # s; statistics are those of the second half
    dt: float = 1e-3  # s, of the controller
    substeps: int = 1  # of the plant within it


class Variant(NamedTuple):
    """One way of doing it."""

    name: str
    settings: str  # how it differs, in the names of the presets' options
    loop: ClosedLoop
    schedule: Schedule = Schedule()


class Answer(NamedTuple):
    """What the numbers say about the theory's prediction."""

    agrees: str  # yes, partly or no
    text: str


def answer(agrees: bool, text: str, partly: bool = False) -> Answer:
    """`yes` if the prediction holds, else `partly` if part of it does, else `no`."""
    return Answer("yes" if agrees else "partly" if partly else "no", text)
