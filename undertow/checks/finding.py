"""What a check has to say: an error or advice, in the house grammar."""

from typing import Literal, NamedTuple


class Finding(NamedTuple):
    """One thing that is wrong or odd."""

    level: Literal["error", "advice"]
    rule: str  # which check it is, one word
    key: str  # of the file: where to look
    says: str  # with the numbers that caused it
    hint: str = ""  # what to try

    def sentence(self, where: str = "") -> str:
        """One line. `where` is the place in a file, when known."""
        place = f" ({where})" if where else ""
        return f"{self.level.capitalize()}: {self.says}{place}{f'. {self.hint}' if self.hint else ''}"


def error(rule: str, key: str, must: str, got: str, hint: str = "") -> Finding:
    """Something that cannot be."""
    return Finding("error", rule, key, f"`{key}` must {must}, but is {got}", hint)


def advice(rule: str, key: str, should: str, got: str, hint: str = "") -> Finding:
    """Something that can be, but seldom is."""
    return Finding("advice", rule, key, f"`{key}` should {should}, but is {got}", hint)
