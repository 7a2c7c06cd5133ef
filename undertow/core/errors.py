"""Errors in one form: the value, what it must be, what it is, and the remedy.

    Error: `plant.thruster.resistance` must be positive, but is -1.2 ohm (scenario.yaml, line 14)

Whoever reads a file says where he stands (`error_location`), so that an error is worded once, where it is found, with
the key path and the line that the user knows.

Advice is not an error: the run continues. A part returns sentences from its method `advice()`; advice on a key of a
file names its place like an error.

    Advice: `reference` has yaw at 45 rad, which is 7.16 turns (scenario.yaml, line 5). Angles are in radians
"""

import contextlib
import difflib
from collections.abc import Callable, Iterable, Iterator
from contextvars import ContextVar
from typing import NamedTuple

_LONGEST = 200  # characters of a value in a message


class _Place(NamedTuple):
    key: str
    location: Callable[[str], str]  # file and line of a key path that starts here; "" where unknown
    note: str
    written: Callable[[str], str]


_PLACES: ContextVar[tuple[_Place, ...]] = ContextVar("places", default=())


@contextlib.contextmanager
def error_location(
    key: str = "",
    location: Callable[[str], str] = lambda name: "",
    note: str = "",
    written: Callable[[str], str] = lambda name: name,
) -> Iterator[None]:
    """Errors that arise inside are about what stands at a key; may be nested, and used as a decorator.

    Args:
        key: key path of what is read or made inside; goes before the names that errors give.
        location: file and line of a key path; the innermost that knows it is asked.
        note: follows the location.
        written: a key path that starts here as the user wrote it, where there is a short form.
    """
    token = _PLACES.set((*_PLACES.get(), _Place(key, location, note, written)))
    try:
        yield
    finally:
        _PLACES.reset(token)


def _placed(name: str, where: str) -> tuple[str, str]:
    """Key path of a name from the outermost place that the code stands within, and its location."""
    for scope in reversed(_PLACES.get()):
        where = where or scope.location(name)
        where = ", ".join(filter(None, (where, scope.note)))
        name = ".".join(filter(None, (scope.key, scope.written(name)))).replace(".[", "[")
    return name, where


class Advice(NamedTuple):
    """What is surely not meant by a value that can be used."""

    says: str  # with the numbers that caused it
    where: str = ""  # file and line, when known
    hint: str = ""  # remedy, a full sentence

    @property
    def sentence(self) -> str:
        """One line, without full stop."""
        return _sentence(self.says, self.where, self.hint)


def advice(name: str, says: str, hint: str = "") -> Advice:
    """Advice on the value of a key, located from the key that the code stands within."""
    return Advice(says, _placed(name, "")[1], hint)


class BadInput(ValueError):
    """A value that the user gave cannot be used. One line; the command line turns it into exit code 2.

    Args:
        name: key path or argument, as the user wrote it, from the key that the code stands within.
        must: what it must be, completing "must ..."; "" where an action failed.
        got: what it is; or which action failed, and why.
        hint: the remedy, a full sentence.
        where: file and line, when known otherwise than by `error_location`.
    """

    def __init__(self, name: str, must: str, got: object = None, *, hint: str = "", where: str = ""):
        name, where = _placed(name, where)
        self.name, self.must, self.got, self.hint, self.where = name, must, got, hint, where
        super().__init__(name, must, got)

    def __str__(self) -> str:
        got = "" if self.got is None else f", but is {_one_line(self.got)}"
        message = f"`{_one_line(self.name)}` must {self.must}{got}"
        if not self.must:
            failed = _one_line(self.got)
            message = f"`{_one_line(self.name)}`: {failed}" if self.name else failed[:1].upper() + failed[1:]
        return _sentence(message, self.where, self.hint)


def _sentence(message: str, where: str, hint: str) -> str:
    location = f" ({where})" if where else ""
    return printable(f"{message}{location}{f'. {hint}' if hint else ''}")


def known_key(key: str, candidates: Iterable[str]) -> str:
    """As `did_you_mean`, for a key; digits are what follows the decimal comma of `{supply: 16,5}`."""
    comma = "Write a decimal point: in braces, a comma starts a new key"
    return comma if key.isdecimal() else did_you_mean(key, candidates)


def joined(*hints: str) -> str:
    """Hints one behind the other, without those that are empty; each is a sentence without full stop."""
    return ". ".join(filter(None, hints)).replace("?. ", "? ")


def did_you_mean(word: str, candidates: Iterable[str]) -> str:
    """Sentence naming the nearest known word, or all of them when none is near."""
    candidates = sorted(set(candidates))
    return nearest(word, candidates) or f"Known: {', '.join(candidates)}"


def nearest(word: str, candidates: Iterable[str]) -> str:
    """Sentence naming the nearest known word, capital letters aside; empty when none is near."""
    by_small = {candidate.lower(): candidate for candidate in candidates}
    near = difflib.get_close_matches(str(word).lower(), list(by_small), n=1, cutoff=0.6)
    return f"Did you mean `{by_small[near[0]]}`?" if near else ""


def printable(text: str) -> str:
    """Text in one line of words that can be shown: characters that act on a terminal are written as escapes."""
    words = (word if len(word) <= _LONGEST else f"{word[: _LONGEST - 3]}..." for word in text.split())
    characters = (
        character if character.isprintable() else character.encode("unicode_escape").decode()
        for character in " ".join(words)
    )
    return "".join(characters)


def _one_line(value: object) -> str:
    text = " ".join(str(value).split())
    return text if len(text) <= _LONGEST else text[: _LONGEST - 3] + "..."
