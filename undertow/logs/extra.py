"""Packages that only some formats need, what their readers print, and why they fail."""

import contextlib
import importlib.util
import io
from collections.abc import Iterator

from undertow.core.errors import BadInput, printable

_LONGEST = 160  # characters of a reason


def check_installed(package: str, title: str) -> None:
    """Check that a package of the extra `logs` is there.

    Raises:
        BadInput: it is not.
    """
    if importlib.util.find_spec(package) is None:
        remedy = "In the folder of undertow, run: pip install -c constraints.txt '.[logs]'"
        raise BadInput("", "", f"{title} is not installed. {remedy}")


@contextlib.contextmanager
def quiet(notes: list[str]) -> Iterator[None]:
    """What is printed inside becomes a note: its first line, and how many there were."""
    printed = io.StringIO()
    with contextlib.redirect_stdout(printed), contextlib.redirect_stderr(printed):
        yield
    lines = [line.strip() for line in printed.getvalue().splitlines() if line.strip()]
    if lines:
        more = f" (and {len(lines) - 1} more such messages of the reader)" if len(lines) > 1 else ""
        notes.append(f"{lines[0]}{more}")


def reason_of(error: Exception) -> str:
    """What an error of a reader says, in one line and not too long."""
    text = printable(str(error)) or type(error).__name__
    return text if len(text) <= _LONGEST else f"{text[: _LONGEST - 3]}..."
