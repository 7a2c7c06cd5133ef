"""Complaints of the YAML parser in words that say what to change, with the line where the mistake was made."""

import re
from typing import NamedTuple

from ruamel.yaml.error import MarkedYAMLError

_ALIGN = "Start all keys of a section in the same column, and what belongs to them further right"

_BRACKETED = re.compile(
    r"""[{,]\s*([\w.-]+\[\d+\][\w.\[\]-]*):(\s[^,}]*)"""
)  # a key such as position[0], and its value


class Mistake(NamedTuple):
    """What is wrong, its line, from 1 (None where unknown), and the remedy, "" where none is known."""

    says: str
    line: int | None
    hint: str


def mistake_of(error: MarkedYAMLError, text: str) -> Mistake:
    """The mistake behind an error of the parser in a text."""
    problem = " ".join((error.problem or "malformed").split())
    problem_line, context_line = _line(error.problem_mark), _line(error.context_mark)
    line = problem_line or context_line
    lines = text.splitlines()
    if r"character '\t'" in problem:
        return Mistake("it has a tab", line, "Indent with spaces")
    if "character" in problem and "cannot start any token" in problem:
        return Mistake(problem.replace(" that cannot start any token", ""), line, "Put text that starts so in quotes")
    if "mapping values are not allowed" in problem:
        if line and len(re.findall(r":(?=\s|$)", _uncommented(_at(lines, line)))) > 1:
            return Mistake("there are two colons in one line", line, "Put text with a colon in quotes")
        above = _last(lines[: line - 1]) if line else 0
        if above and re.fullmatch(r"[\w-]+:[^\s:]+", _uncommented(lines[above - 1]).strip()):
            return Mistake("a colon has no space after it", above, "Write `key: value`, with a space after the colon")
        return Mistake("the indentation does not fit the line above", line, _ALIGN)
    if "expected <block end>" in problem or "entries are not allowed" in problem:
        return Mistake("the indentation does not fit the lines above", line, _ALIGN)
    if "could not find expected ':'" in problem:
        return Mistake("a key has no colon", context_line or line, "Write `key: value`, with a space after the colon")
    if "expected ',' or '}'" in problem and line and (key := _BRACKETED.search(_uncommented(_at(lines, line)))):
        hint = f'Inside braces, quote a key that has brackets: {{"{key[1]}":{key[2]}}}'
        return Mistake(f"the key {key[1]} has brackets, but no quotes", line, hint)
    if opened := re.match(r"expected ',' or '([\]}])'", problem):
        closing = opened[1]
        message = f"a `{'[' if closing == ']' else '{'}` is not closed, or lacks a comma"
        return Mistake(message, context_line or line, f"Add `{closing}`, and commas between the entries")
    if "quoted scalar" in str(error.context) and "escape" not in problem:
        return Mistake("a quotation mark is not closed", context_line or line, "Close it in the same line")
    if "escape" in problem:
        return Mistake(problem, line, "Put text with a backslash in single quotes")
    return Mistake(problem, line, "")


def _line(mark) -> int | None:
    return None if mark is None else mark.line + 1


def _last(lines: list[str]) -> int:
    """Number of the last line with more than a comment; 0 where there is none."""
    return max((number for number, line in enumerate(lines, start=1) if _uncommented(line).strip()), default=0)


def _at(lines: list[str], line: int) -> str:
    """A line by its number; empty behind the end of the text, where the parser misses something."""
    return lines[line - 1] if line <= len(lines) else ""


def _uncommented(line: str) -> str:
    return re.sub(r"(^|\s)#.*", "", line)
