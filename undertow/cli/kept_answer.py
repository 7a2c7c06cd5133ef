"""Answers of commands that depend on nothing but what is installed: printed again at once, without computing them."""

import contextlib
import importlib.metadata
import io
import os
import shutil
import sys
from collections.abc import Callable

from undertow.core.installation import foreign_modules, installation
from undertow.core.kept_code import kept_code
from undertow.core.part_packages import PACKAGE_OF

# What decides how a terminal is written to, besides its width.
_LOOKS = ("COLUMNS", "TERM", "COLORTERM", "NO_COLOR", "FORCE_COLOR", "TTY_COMPATIBLE")


class _NotKept(Exception):
    """The answer is no success."""


class _Copy(io.StringIO):
    """Text that is written as to standard output."""

    def isatty(self) -> bool:
        return sys.__stdout__ is not None and sys.__stdout__.isatty()

    @property
    def encoding(self) -> str:  # pyright: ignore[reportIncompatibleVariableOverride]
        return _encoding()


def _encoding() -> str:
    return getattr(sys.__stdout__, "encoding", None) or "utf-8"


def print_kept(asked: object, answer: Callable[[], int | None]) -> int | None:
    """What a command prints, of this process or of an earlier one of the same installation; returns its exit code.

    Args:
        asked: command and options, by their `repr`.
        answer: prints it, and returns the exit code.
    """
    if foreign_modules() or _others_have_parts():
        return answer()
    code: int | None = None

    def printed() -> bytes:
        nonlocal code
        copy = _Copy()
        with contextlib.redirect_stdout(copy):
            code = answer()
        if code:
            sys.stdout.write(copy.getvalue())
            raise _NotKept
        return copy.getvalue().encode(_encoding(), "replace")

    looks = [os.environ.get(name) for name in _LOOKS]
    terminal = shutil.get_terminal_size(), _Copy().isatty(), _encoding()
    try:
        text = kept_code(("answer", asked, looks, terminal, *installation()), printed).decode(_encoding())
    except _NotKept:
        return code
    sys.stdout.write(text)
    return code


def _others_have_parts() -> bool:
    """Whether another installed package has parts, which the answers name."""
    groups = {f"undertow.{kind}" for kind in (*PACKAGE_OF, "metrics")}
    return any(importlib.metadata.entry_points().select(group=group) for group in groups)
