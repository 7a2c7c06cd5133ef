"""One process at a time writes to a store."""

import fcntl
import os
from pathlib import Path

from undertow.core.errors import BadInput


def locked(path: Path) -> int:
    """A lock that goes with the process, however it ends."""
    handle = os.open(path.with_name(f".{path.name}.lock"), os.O_CREAT | os.O_RDWR)
    try:
        fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except OSError:
        os.close(handle)
        raise BadInput("--out", "be a folder that nothing else writes to", str(path.parent)) from None
    return handle


def check_free(path: Path) -> None:
    """That no process is writing to a store.

    Raises:
        BadInput: one is.
    """
    os.close(locked(path))
