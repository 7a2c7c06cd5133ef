"""Safe writing: what is written is whole, and survives a power cut."""

import contextlib
import errno
import os
import secrets
import shutil
import stat
from collections.abc import Iterator
from pathlib import Path


@contextlib.contextmanager
def replacing(path: Path) -> Iterator[Path]:
    """A new file to write to, which takes the place of a path where the block ends well, and survives a power cut.

    What was there stays until then, whatever happens, and gives its permissions. A link stays one, to its new file.
    """
    target = path.resolve()
    if not target.parent.is_dir():
        raise FileNotFoundError(errno.ENOENT, "The folder does not exist", str(path.parent))
    temporary = target.with_name(f".{target.stem}.{secrets.token_hex(4)}{target.suffix}")
    os.close(os.open(temporary, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o666))
    try:
        yield temporary
        with contextlib.suppress(FileNotFoundError):
            os.chmod(temporary, stat.S_IMODE(target.stat().st_mode))
        sync(temporary)
        os.replace(temporary, target)
        sync(target.parent)
    except BaseException as error:
        temporary.unlink(missing_ok=True)
        if isinstance(error, OSError) and error.errno:
            error.filename = str(path)  # the name that users know
        raise


def write_whole(path: Path, content: str | bytes | memoryview) -> None:
    """Write a file whole or not at all; text as UTF-8."""
    with replacing(path) as file:
        file.write_bytes(content.encode() if isinstance(content, str) else content)


@contextlib.contextmanager
def replacing_folder(path: Path) -> Iterator[Path]:
    """A new folder to fill, which takes the place of a path where the block ends well.

    What was there stays until the new folder is whole; the end of the process between two renamings leaves it under a
    hidden name.
    """
    number = secrets.token_hex(4)
    new, old = (path.with_name(f".{path.name}.{number}.{which}") for which in ("new", "old"))
    new.mkdir()
    try:
        yield new
        fsync_tree(new)
        if path.exists():
            os.replace(path, old)
        try:
            os.replace(new, path)
        except BaseException:
            if old.exists():
                os.replace(old, path)
            raise
        sync(path.parent)
    finally:
        for leftover in (new, old):
            shutil.rmtree(leftover, ignore_errors=True)


def fsync_tree(path: Path) -> None:
    """Wait until a file, or everything in a folder, is on the disk and survives a power cut."""
    if path.is_dir():
        for inner in path.iterdir():
            fsync_tree(inner)
    sync(path)


def sync(path: Path) -> None:
    """Wait until one file, or the names in a folder, are on the disk."""
    handle = os.open(path, os.O_RDONLY)
    try:
        os.fsync(handle)
    finally:
        os.close(handle)
