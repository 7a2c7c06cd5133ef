"""Error messages: a test pins what a user needs of them, and leaves the words between free.

The whole sentences of `cli/test_bad_scenarios.py` hold the wording of the common forms.
"""

import re
from typing import NamedTuple

KEY = re.compile(r"`([^`]+)`")
FILE_AND_LINE = re.compile(r" \(([^()]*, line \d+[^()]*)\)")
NUMBER = re.compile(r"-?\d+(?:\.\d+)?(?:e[+-]?\d+)?")


class Named(NamedTuple):
    """What a message names."""

    key: str  # or argument, that comes first
    numbers: list[str]  # what is allowed, and what was given
    place: str  # file and line; empty where there is no file
    remedy: str  # the sentences that follow


def named(message: str) -> Named:
    """What a message of the form "`key` must ..., but is ... (file, line 1). Remedy" names."""
    key, place = KEY.search(message), FILE_AND_LINE.search(message)
    complaint, _, remedy = message.partition(". ")
    if place:
        complaint, remedy = message[: place.start()], message[place.end() :].removeprefix(". ")
    return Named(key[1] if key else "", NUMBER.findall(complaint), place[1] if place else "", remedy)
