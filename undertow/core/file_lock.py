"""One process at a time writes to a path."""

import contextlib
import os
from collections.abc import Iterator
from pathlib import Path

from filelock import FileLock, Timeout

from undertow.core.errors import BadInput

_PATIENCE = 0.1  # s; whoever opens a lock file that its owner is removing has to try again


class InUse(BadInput):
    """Another process is writing to the path."""


@contextlib.contextmanager
def file_lock(path: Path) -> Iterator[None]:
    """Lock a file or folder for writing by this process only; the lock is released however the process ends.

    Args:
        path: file or folder to write; it need not exist, but its parent folder must.

    Raises:
        InUse: another process is writing to it.
        OSError: it cannot be written to, or its file system has no locks.
    """
    lock_file = lock_of(path)
    if not lock_file.exists():
        lock_file.touch()  # an error where no file can be made, as in /proc; `filelock` would wait until it can
    # A file system without locks is an error: the mark that `filelock` would set there outlives a killed process.
    lock = FileLock(lock_file, timeout=_PATIENCE, thread_local=False, fallback_to_soft=False)
    try:
        lock.acquire()
    except Timeout:
        raise InUse("--out", "be a folder that nothing else writes to", str(path)) from None
    try:
        yield
    finally:
        # While it is held, so that nobody else's is removed. Windows keeps an open file; there `filelock` removes it.
        with contextlib.suppress(OSError):
            lock_file.unlink()
        lock.release()


def lock_of(path: Path) -> Path:
    """The lock file: beside the path, or inside it where the parent folder cannot be written to."""
    path = path.resolve()
    name = f".{path.name}.lock"
    return path / name if path.is_dir() and not os.access(path.parent, os.W_OK) else path.with_name(name)
