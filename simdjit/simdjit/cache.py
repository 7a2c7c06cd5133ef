"""Compiled code, kept from one process to the next.

Code in the cache runs with the user's rights. So it lies in a folder that nobody else may write, and an entry is used
only if it is the user's own file and its checksum agrees; any other is made again.
"""

import contextlib
import hashlib
import os
import stat
import tempfile
from collections.abc import Callable
from pathlib import Path

_OTHERS_MAY_WRITE = stat.S_IWGRP | stat.S_IWOTH
_DIGEST = hashlib.sha256().digest_size


def default_folder() -> Path:
    """SIMDJIT_CACHE, or `simdjit` in the user's folder of caches."""
    folder = os.environ.get("SIMDJIT_CACHE")
    return Path(folder) if folder else Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "simdjit"


def cached(key: object, suffix: str, make: Callable[[], bytes], folder: Path | None = None) -> bytes:
    """Result of `make`, or what it was in an earlier process.

    Args:
        key: everything that the result depends on; by its `repr`.
        suffix: of the file.
        make: computes the result.
        folder: of the cache; made where there is none. None for the default.
    """
    name = f"{hashlib.sha256(repr(key).encode()).hexdigest()}{suffix}"
    folder = default_folder() if folder is None else folder
    try:
        folder.parent.mkdir(parents=True, exist_ok=True)
        with contextlib.suppress(FileExistsError):
            folder.mkdir(mode=0o700)
        _insist_on_private(os.lstat(folder), stat.S_ISDIR)
    except OSError:  # a cache that cannot be trusted is none
        return make()
    try:
        return _read(folder / name)
    except OSError:
        made = make()
    with contextlib.suppress(OSError):  # a cache that cannot be written is none
        _write(folder / name, made)
    return made


def _read(path: Path) -> bytes:
    """What was written to a file.

    Raises:
        OSError: there is none, or somebody else may have written it, or it is damaged.
    """
    with open(os.open(path, os.O_RDONLY | getattr(os, "O_NOFOLLOW", 0)), "rb") as file:
        _insist_on_private(os.fstat(file.fileno()), stat.S_ISREG)
        digest, made = file.read(_DIGEST), file.read()
    if digest != _checksum(path.name, made):
        raise OSError(f"{path} is damaged")
    return made


def _write(path: Path, made: bytes) -> None:
    """A file that appears whole or not at all, even if the power fails."""
    handle, part = tempfile.mkstemp(dir=path.parent)  # a name of its own, readable by the user alone
    try:
        with open(handle, "wb") as file:
            file.write(_checksum(path.name, made) + made)
            file.flush()
            os.fsync(file.fileno())
        os.replace(part, path)
    except BaseException:
        Path(part).unlink(missing_ok=True)
        raise


def _checksum(name: str, made: bytes) -> bytes:
    """Of an entry under its own name: one under another's is as good as damaged."""
    return hashlib.sha256(name.encode() + made).digest()


def _insist_on_private(status: os.stat_result, kind: Callable[[int], bool]) -> None:
    """As far as the system knows of users."""
    somebody = hasattr(os, "geteuid") and (status.st_uid != os.geteuid() or status.st_mode & _OTHERS_MAY_WRITE)
    if somebody or not kind(status.st_mode):
        raise OSError("somebody else may have written this")
