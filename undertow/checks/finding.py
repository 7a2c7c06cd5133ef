"""Findings of checks: errors and advice, in the form of all messages."""

from typing import Literal, NamedTuple


class Finding(NamedTuple):
    """One error or one advice."""

    level: Literal["error", "advice"]
    rule: str  # name of the rule, one word
    key: str  # key of the file, or method
    says: str  # with the numbers that caused it
    hint: str = ""  # remedy

    def sentence(self, where: str = "") -> str:
        """One line. `where` is the location in a file, when known."""
        place = f" ({where})" if where else ""
        return f"{self.level.capitalize()}: {self.says}{place}{f'. {self.hint}' if self.hint else ''}"


def error(rule: str, key: str, must: str, got: str, hint: str = "") -> Finding:
    """Finding of something impossible."""
    return Finding("error", rule, key, f"`{key}` must {must}, but is {got}", hint)


def advice(rule: str, key: str, should: str, got: str, hint: str = "") -> Finding:
    """Finding of something possible but unlikely."""
    return Finding("advice", rule, key, f"`{key}` should {should}, but is {got}", hint)
