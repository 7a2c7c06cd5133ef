"""One process at a time writes to a path.

`filelock` would do the same, but leaves its file beside every result: removing it safely takes the handle, which that
library keeps to itself.
"""

import contextlib
import os
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from undertow.core.errors import BadInput

try:
    import fcntl
except ImportError:  # Windows has none
    fcntl: Any = None


class InUse(BadInput):
    """Another process is writing to the path."""


@contextlib.contextmanager
def file_lock(path: Path) -> Iterator[None]:
    """Lock a file or folder for writing by this process only; the lock is released however the process ends.

    Args:
        path: file or folder to write; it need not exist, but its parent folder must.

    Raises:
        InUse: another process is writing to it.
        OSError: it cannot be written to.
    """
    lock = lock_of(path)
    handle = _locked(lock, path)
    try:
        yield
    finally:
        with contextlib.suppress(OSError):  # one that stays is not locked, and harms nobody
            lock.unlink()  # while it is held: a waiting process sees that its file was replaced
        os.close(handle)


def lock_of(path: Path) -> Path:
    """The lock file: beside the path, or inside it where the parent folder cannot be written to."""
    path = path.resolve()
    name = f".{path.name}.lock"
    return path / name if path.is_dir() and not os.access(path.parent, os.W_OK) else path.with_name(name)


def _locked(lock: Path, path: Path) -> int:
    while True:
        handle = os.open(lock, os.O_CREAT | os.O_RDWR, 0o644)
        try:
            try_lock(handle)
            if _same(handle, lock):
                return handle
        except BlockingIOError:
            os.close(handle)
            raise InUse("--out", "be a folder that nothing else writes to", str(path)) from None
        except BaseException:
            os.close(handle)
            raise
        os.close(handle)  # its owner has removed the file meanwhile


def _same(handle: int, lock: Path) -> bool:
    try:
        return os.path.samestat(os.fstat(handle), lock.stat())
    except FileNotFoundError:
        return False


def try_lock(handle: int) -> None:
    """Lock an open file; BlockingIOError where another process has locked it."""
    if fcntl is not None:
        fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
        return
    import msvcrt

    windows: Any = msvcrt
    try:
        windows.locking(handle, windows.LK_NBLCK, 1)
    except OSError as error:
        raise BlockingIOError(*error.args) from error
