"""Safe writing: one process at a time writes to a path, and what is written survives a power cut."""

import contextlib
import fcntl
import os
from collections.abc import Iterator
from pathlib import Path

from undertow.core.errors import BadInput


class InUse(BadInput):
    """Another process is writing to the path."""


@contextlib.contextmanager
def alone(path: Path) -> Iterator[None]:
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
        lock.unlink(missing_ok=True)  # while it is held: a waiting process sees that its file was replaced
        os.close(handle)


def lock_of(path: Path) -> Path:
    """The lock file: beside the path, or inside it where the parent folder cannot be written to."""
    path = path.resolve()
    name = f".{path.name}.lock"
    return path / name if path.is_dir() and not os.access(path.parent, os.W_OK) else path.with_name(name)


def write_whole(path: Path, text: str) -> None:
    """Write a text file whole or not at all."""
    partial = path.with_suffix(".partial")
    partial.write_text(text, encoding="utf-8")
    partial.replace(path)


def settle(path: Path) -> None:
    """Wait until a file, or everything in a folder, is on the disk and survives a power cut."""
    if path.is_dir():
        for inner in path.iterdir():
            settle(inner)
    sync(path)


def sync(path: Path) -> None:
    """Wait until one file, or the names in a folder, are on the disk."""
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
        os.close(handle)  # its owner has removed the file meanwhile


def _same(handle: int, lock: Path) -> bool:
    try:
        return os.path.samestat(os.fstat(handle), lock.stat())
    except FileNotFoundError:
        return False
