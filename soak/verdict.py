"""Never-events of undertow, and the verdict of one hostile input by what it did."""

import re
from collections.abc import Mapping, Sequence
from typing import NamedTuple

from undertow.core.errors import printable

EVENTS = {
    "N1": "An input that is not finite or beyond its limits reached the plant.",
    "N2": "An uncaught exception or a traceback reached the user, or a process died by a signal that nobody sent.",
    "N3": "A run or a command exceeded its limit of steps or of time.",
    "N4": "A run was called completed although a state is not finite, or rows are missing.",
    "N5": "A trial was lost, doubled or altered by an interruption.",
    "N6": "The same inputs gave other bytes.",
    "N7": "A key, a fault or an option was ignored in silence.",
    "N8": "A vehicle behind a link was not stopped in time, or got full thrust from one message or signal.",
    "N9": "A log lost more than its last second.",
    "message": "An error is not one line that names a key, a line, a file or an option.",
    "partial": "A command that failed left files behind.",
}

REFUSED = (2, 4)  # exit codes of a command that could not use its input
_ACCEPTED = (0, 1)
_LONGEST = 2000  # characters of a line
_NAMED = 100  # first characters of a name, by which a message may name it: long ones are shortened
_SLOW, _HANGING = 1.0, 20.0  # s of processor time: for a rejection, and for anything
_UNPRINTABLE = re.compile(r"[\x00-\x08\x0b-\x1f\x7f-\x9f\u2028\u2029]")
_COMMAND_LINE = re.compile(r"See `undertow[^`]*--help`")
_PLACE = re.compile(r"`[^`]+`|, line \d+")


class Done(NamedTuple):
    """What a hostile input did.

    Attributes:
        code: exit code; None where the process died or was ended.
        out, err: what it printed.
        seconds: processor time of the process, and elapsed time, s.
        left: files that are there afterwards and were not before, or whose bytes changed.
    """

    code: int | None
    out: str
    err: str
    seconds: tuple[float, float]
    left: Sequence[str]


class Failure(NamedTuple):
    """One never-event.

    Attributes:
        event: a key of `EVENTS`.
        identity: what repeats it with `python -m soak --replay`.
        says: what happened, in one line.
        arguments: of `undertow`, where a command line caused it.
        files: names of the files that it needs.
    """

    event: str
    identity: str
    says: str
    arguments: Sequence[str] = ()
    files: Sequence[str] = ()


def failure_of(
    identity: str, arguments: Sequence[str], files: Mapping[str, bytes | None], done: Done
) -> Failure | None:
    """The never-event of a hostile input; None where it was accepted or refused as it must be.

    Args:
        identity: of the input.
        arguments: of `undertow`.
        files: that it was given.
        done: what it did.
    """
    event_and_message = _event(arguments, files, done)
    return event_and_message and Failure(
        event_and_message[0], identity, event_and_message[1], list(arguments), list(files)
    )


def _event(arguments: Sequence[str], files: Mapping[str, bytes | None], done: Done) -> tuple[str, str] | None:
    if done.code is None:
        return "N2", f"the process died: {_last(done.err) or 'no message'}"
    if done.seconds[0] > _HANGING:
        return "N3", f"took {done.seconds[0]:.1f} s of processor time"
    if "Traceback (most recent call last)" in done.out + done.err or done.code not in (*REFUSED, *_ACCEPTED):
        return "N2", f"exit code {done.code}: {_last(done.err)}"
    errors = [line for line in done.err.splitlines() if line.startswith("Error: ")]
    if done.code == 2 and not errors and re.search(r"\d+ errors?, ", done.out):
        return None  # findings of `check`, which stand in its report
    if done.code not in REFUSED:
        return ("message", f"exit code {done.code} with an error: {errors[0]}") if errors and done.code == 0 else None
    return _rejection(arguments, files, done, errors)


def _rejection(
    arguments: Sequence[str], files: Mapping[str, bytes | None], done: Done, errors: Sequence[str]
) -> tuple[str, str] | None:
    if len(errors) != 1 or done.err.count("\n") != 1 + sum(_is_advice(line) for line in done.err.splitlines()):
        return "message", f"{len(errors)} errors in {done.err.count(chr(10))} lines: {_last(done.err)}"
    if len(errors[0]) > _LONGEST:
        return "message", f"an error of {len(errors[0])} characters: {errors[0][:80]}..."
    if _UNPRINTABLE.search(errors[0]):
        return "message", f"an error with characters that cannot be printed: {errors[0]!r}"
    names = [printable(name)[:_NAMED] for name in (*files, *arguments)]
    if not (_PLACE.search(errors[0]) or _COMMAND_LINE.search(errors[0]) or any(n and n in errors[0] for n in names)):
        return "message", f"an error that names nothing: {errors[0]}"
    if done.left:
        return "partial", f"exit code {done.code}, and left {', '.join(list(done.left)[:4])}"
    if done.seconds[0] > _SLOW:
        return "N3", f"a rejection after {done.seconds[0]:.2f} s of processor time"
    return None


def _is_advice(line: str) -> bool:
    return line.startswith(("Advice: ", "Warning: "))


def _last(text: str) -> str:
    lines = text.strip().splitlines()
    return lines[-1][:300] if lines else ""
