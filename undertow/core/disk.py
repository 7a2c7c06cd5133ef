"""Files that outlast others and power cuts: one process at a time writes to a place; what is done is on the disk."""

import contextlib
import fcntl
import os
from collections.abc import Iterator
from pathlib import Path

from undertow.core.errors import BadInput


class InUse(BadInput):
    """Another process is writing there."""


@contextlib.contextmanager
def alone(path: Path) -> Iterator[None]:
    """Be the only process that writes to a file or folder; the lock goes with the process, however it ends.

    Args:
        path: what is written to; it need not exist, the folder that it is in must.

    Raises:
        InUse: another process is writing there.
        OSError: nothing can be written there.
    """
    lock = lock_of(path)
    handle = _locked(lock, path)
    try:
        yield
    finally:
        lock.unlink(missing_ok=True)  # while it is held: whoever waits for it sees that the file is another one
        os.close(handle)


def lock_of(path: Path) -> Path:
    """The file that is locked: beside what it guards; inside where nothing can be written beside."""
    path = path.resolve()
    name = f".{path.name}.lock"
    return path / name if path.is_dir() and not os.access(path.parent, os.W_OK) else path.with_name(name)


def settle(path: Path) -> None:
    """Wait until a file, or all that is in a folder, is on the disk: a power cut after this takes nothing of it."""
    if path.is_dir():
        for inner in path.iterdir():
            settle(inner)
    sync(path)


def sync(path: Path) -> None:
    """The same for one file, or for the names in a folder."""
    handle = os.open(path, os.O_RDONLY)
    try:
        os.fsync(handle)
    finally:
        os.close(handle)


def _locked(lock: Path, path: Path) -> int:
    while True:
        handle = os.open(lock, os.O_CREAT | os.O_RDWR, 0o644)
        try:
            fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
            if _same(handle, lock):
                return handle
        except BlockingIOError:
            os.close(handle)
            raise InUse("--out", "be a folder that nothing else writes to", str(path)) from None
        except BaseException:
            os.close(handle)
            raise
        os.close(handle)  # of a file that its owner has removed meanwhile


def _same(handle: int, lock: Path) -> bool:
    try:
        return os.path.samestat(os.fstat(handle), lock.stat())
    except FileNotFoundError:
        return False
