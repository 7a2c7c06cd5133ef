"""Packages that only some formats need, and what their readers print."""

import contextlib
import importlib.util
import io
from collections.abc import Iterator

from undertow.core.errors import BadInput


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
