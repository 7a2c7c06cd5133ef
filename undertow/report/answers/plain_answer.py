"""An answer: whether it went well, and a few lines on why."""

from typing import NamedTuple

from undertow.report.formats import prose
from undertow.report.page import Html, bullets, tag


class PlainAnswer(NamedTuple):
    """What is said first of a run or a study.

    Attributes:
        good: whether it went well; None where nothing says what counts as that.
        verdict: the same in a sentence.
        lines: three to seven: the numbers that matter, what they are judged by, what limits, and what to do next.
    """

    good: bool | None
    verdict: str
    lines: tuple[str, ...]

    @property
    def text(self) -> list[str]:
        """The lines for a terminal."""
        return [self.verdict, *self.lines]


def answer_block(answer: PlainAnswer) -> Html:
    """The answer on a page, with a colour that says whether it went well."""
    looks = {True: "holds", False: "fails", None: "open"}[answer.good]
    lines = bullets([prose(line) for line in answer.lines])
    return tag("div", tag("p", tag("strong", prose(answer.verdict))), lines, class_=f"answer {looks}")
