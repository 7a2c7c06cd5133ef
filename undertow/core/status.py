"""How a run ended: a code carried through compiled code, a sentence on the host."""

import enum


class Status(enum.IntEnum):
    """State of a run at an instant, and at last how it ended. Codes are data: one bad run never costs the others.

    OK goes on; a run that is OK at its end is `completed`, which says nothing of whether control succeeded.
    """

    OK = 0
    DIVERGED = 1
    NOT_FINITE = 2
    PITCH_SINGULAR = 3
    STEPS_EXHAUSTED = 4
    OUT_OF_RANGE = 5
    COMMAND_NOT_FINITE = 6

    @property
    def word(self) -> str:
        """How a run ended, as it stands in results files."""
        return "completed" if self is Status.OK else self.name.lower()

    @property
    def sentence(self) -> str:
        """What happened, for people."""
        return _SENTENCES[self]


_SENTENCES = {
    Status.OK: "The run reached its end.",
    Status.DIVERGED: "A position or velocity left every sensible envelope: the loop is unstable.",
    Status.NOT_FINITE: "A state became infinite, undefined, or too large to be squared; the last sound one was kept.",
    Status.PITCH_SINGULAR: "Pitch came within 0.06 degrees of +-90, where Euler angles, and so Eq. (1), are undefined.",
    Status.STEPS_EXHAUSTED: "The adaptive integrator could go no further: too stiff a loop, or an undefined rate.",
    Status.OUT_OF_RANGE: "An output left the range in which the plant can be held: a ball touched its magnet, "
    "or a pendulum fell flat.",
    Status.COMMAND_NOT_FINITE: "The controller commanded an input that is infinite or undefined.",
}
