"""The results folder of a command: locked while it runs, written completely or not at all, never replaced silently."""

import contextlib
import itertools
import os
import shutil
import sys
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import NamedTuple

from undertow.core.atomic_io import fsync_tree, sync
from undertow.core.errors import BadInput
from undertow.core.file_lock import InUse, file_lock, lock_of


class Draft(NamedTuple):
    """Results being written."""

    path: Path  # the staging folder
    publish: Callable[[], None]  # moves its contents to the results folder; may be called again for later files


@contextlib.contextmanager
def output_folder(out: Path | None, default: Path) -> Iterator[Path]:
    """The folder that a command writes to, locked while it runs.

    Args:
        out: the folder given by the user.
        default: without `out`, this folder or the first of default-2, default-3, ... that is free and not locked.

    Raises:
        BadInput: another process is writing there, or the folder cannot be written.
    """
    folder = default if out is None else out
    new_parents = [parent for parent in (folder.parent, *folder.parent.parents) if not parent.exists()]
    try:
        with contextlib.ExitStack() as held:
            if out is None:
                folder = _next_held(default, held)
            else:
                _hold(out, held)
            yield folder
    finally:
        for parent in new_parents:
            with contextlib.suppress(OSError):  # results are in it
                parent.rmdir()


def is_free(folder: Path) -> bool:
    """Whether the folder does not exist, or holds only what a killed process left."""
    if not folder.is_dir():
        return not folder.exists()
    return {path.name for path in folder.iterdir()} <= {_staging_name(folder), lock_of(folder).name}


def _next_held(folder: Path, held: contextlib.ExitStack) -> Path:
    for number in itertools.count(1):
        candidate = folder if number == 1 else folder.with_name(f"{folder.name}-{number}")
        if not is_free(candidate):
            continue
        with contextlib.ExitStack() as lock, contextlib.suppress(InUse):
            _hold(candidate, lock)
            if is_free(candidate):  # still
                held.enter_context(lock.pop_all())
                return candidate
    raise AssertionError("there are always further numbers")


def _hold(folder: Path, held: contextlib.ExitStack) -> None:
    _check_place(folder)
    try:
        folder.parent.mkdir(parents=True, exist_ok=True)
        held.enter_context(file_lock(folder))
    except OSError as error:
        raise _unwritable(folder, error) from None


@contextlib.contextmanager
def results_folder(folder: Path, names: Sequence[str], marker: str, overwrite: bool) -> Iterator[Draft]:
    """A staging folder whose contents move to `folder` on success and are removed otherwise.

    Args:
        folder: the results folder, locked by `output_folder`; created with its parents if missing.
        names: files and folders that will be written.
        marker: the one of them that identifies an earlier result.
        overwrite: whether an earlier result may be replaced; files of other names always stay.

    Raises:
        BadInput: `folder` cannot be used. Raised before anything is computed.
    """
    check_folder(folder, names, marker, overwrite)
    staging = _stage(folder)
    published: list[Path] = []
    rescued: list[Path] = []

    def publish() -> None:
        try:
            _publish(staging, folder, names, marker)
        except OSError:
            rescued.append(_rescued(staging, folder))
            print(f"The results are in {rescued[0]}.", file=sys.stderr)
            raise
        published.append(folder)

    try:
        yield Draft(staging, publish)
        publish()
    except KeyboardInterrupt:
        missing = ", ".join(name for name in names if not (folder / name).exists())
        message = f"The results are in {folder}" + (f", without {missing}" if missing else "")
        print(f"{message if published else f'No results were written to {folder}'}.", file=sys.stderr)
        raise
    finally:
        if not rescued:
            shutil.rmtree(staging, ignore_errors=True)


def check_folder(
    folder: Path,
    names: Sequence[str],
    marker: str,
    overwrite: bool,
    hint: str = "Add --overwrite to replace it, or choose another folder",
) -> None:
    """Check that results may be written to a folder; see `results_folder`. `hint` is the remedy for an earlier result.

    Raises:
        BadInput: the folder cannot be used.
    """
    _check_place(folder)
    existing = [name for name in names if (folder / name).exists()]
    if not existing:
        return
    if not (folder / marker).exists():
        got, move = (
            f"{folder}, which has {existing[0]}",
            f"Choose another folder, or move {existing[0]} out of this one",
        )
        raise BadInput("--out", "be a folder without files of the names of results", got, hint=move)
    links = [name for name in names if (folder / name).is_symlink() and (folder / name).is_dir()]
    if overwrite and links:
        got, hint_ = f"{folder}, where {links[0]} is one", f"Remove the link {links[0]}, or choose another folder"
        raise BadInput("--out", "be a folder whose folders are no links", got, hint=hint_)
    if not overwrite:
        raise BadInput("--out", "be a folder without an earlier result", f"{folder}, which has {marker}", hint=hint)


def _check_place(folder: Path) -> None:
    if not folder.resolve().name:
        raise BadInput("--out", "be a folder inside another one", str(folder), hint="Choose another name")
    if folder.is_symlink() and not folder.exists():
        got = f"{folder}, a link to {os.readlink(folder)}, which is not there"
        raise BadInput("--out", "be a folder", got, hint="Make that folder, or choose another name")
    for part in (folder, *folder.parents):
        if part.exists() and not part.is_dir():
            got = f"{folder}, a file" if part == folder else f"{folder}, and {part} is a file"
            raise BadInput("--out", "be a folder", got, hint="Choose another name")


def _unwritable(folder: Path, error: OSError) -> BadInput:
    got = f"{folder}, where nothing can be written ({error.strerror})"
    hint = "Choose another folder"
    return BadInput("--out", "be a folder that can be made and written", got, hint=hint)


def _staging_name(folder: Path) -> str:
    return f".{folder.resolve().name}.partial"


def _stage(folder: Path) -> Path:
    """A hidden folder inside `folder` if that exists, else beside it: on the same disk, so that moving is renaming.

    Its name is fixed, so that the next command removes what a killed process left.
    """
    beside, inside = folder.parent / _staging_name(folder), folder / _staging_name(folder)
    staging = inside if folder.exists() else beside
    try:
        for leftover in (beside, inside):
            if leftover.is_dir():
                shutil.rmtree(leftover)
        staging.mkdir(parents=True)
    except OSError as error:
        raise _unwritable(folder, error) from None
    return staging


def _publish(staging: Path, folder: Path, names: Sequence[str], marker: str) -> None:
    """Move all files, the marker last. After a marker, remove what is left of an earlier result."""
    fsync_tree(staging)
    if folder.exists():
        new = [path.name for path in staging.iterdir()]
        for name in new:
            if name != marker:
                _move(staging / name, folder / name)
        if marker in new:
            _move(staging / marker, folder / marker)
            for name in names:
                if name not in new:
                    remove(folder / name)
    else:
        os.replace(staging, folder)
        staging.mkdir()
    sync(folder)
    sync(folder.parent)


def _move(new: Path, old: Path) -> None:
    if old.is_dir():
        remove(old)
    os.replace(new, old)


def _rescued(staging: Path, folder: Path) -> Path:
    """Where results are that could not be moved to their folder: under a name that no later command removes."""
    for number in itertools.count(1):
        target = staging.with_name(f"{folder.resolve().name}-rescued-{number}")
        if not target.exists():
            with contextlib.suppress(OSError):
                os.replace(staging, target)
                return target
            return staging
    raise AssertionError("there are always further numbers")


def remove(path: Path) -> None:
    """Remove a file, or a folder with all it holds, if there is one."""
    shutil.rmtree(path) if path.is_dir() else path.unlink(missing_ok=True)
