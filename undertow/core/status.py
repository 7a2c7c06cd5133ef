"""Status of a run: a code in compiled code, a sentence on the host."""

import enum


class Status(enum.IntEnum):
    """Status of a run at an instant. Codes are data, so that a failed run does not stop the others of a batch.

    A run that is OK at its end is `completed`, which does not say whether control succeeded.
    """

    OK = 0
    DIVERGED = 1
    NOT_FINITE = 2
    PITCH_SINGULAR = 3
    STEPS_EXHAUSTED = 4
    OUT_OF_RANGE = 5
    COMMAND_NOT_FINITE = 6

    def __str__(self) -> str:
        return self.word

    @property
    def word(self) -> str:
        """How a run ended, as written in result files."""
        return "completed" if self is Status.OK else self.name.lower()

    @property
    def sentence(self) -> str:
        """How a run ended, in a sentence."""
        return _SENTENCES[self]


_SENTENCES = {
    Status.OK: "The run reached its end.",
    Status.DIVERGED: "A position or velocity left the plausible range: the loop is unstable.",
    Status.NOT_FINITE: "A state became non-finite or overflowed; the last valid state was kept.",
    Status.PITCH_SINGULAR: "Pitch came within 0.06 degrees of +-90, where Euler angles, and so Eq. (1), are undefined.",
    Status.STEPS_EXHAUSTED: "The adaptive integrator could go no further: too stiff a loop, or an undefined rate.",
    Status.OUT_OF_RANGE: "An output left the range in which the plant can be held: a ball touched its magnet, "
    "or a pendulum fell flat.",
    Status.COMMAND_NOT_FINITE: "The controller commanded an input that is infinite or undefined.",
}
