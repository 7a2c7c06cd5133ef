"""Where results go: nothing half-written is left behind, nothing is silently destroyed."""

import contextlib
import os
import shutil
import tempfile
from collections.abc import Iterator, Sequence
from pathlib import Path

from undertow.core.errors import BadInput


def next_free(folder: Path) -> Path:
    """The folder, or folder-2, folder-3, ...: the first that does not exist or is empty."""
    candidate, number = folder, 1
    while candidate.is_file() or (candidate.is_dir() and any(candidate.iterdir())):
        number += 1
        candidate = folder.with_name(f"{folder.name}-{number}")
    return candidate


@contextlib.contextmanager
def results_folder(folder: Path, names: Sequence[str], marker: str, overwrite: bool) -> Iterator[Path]:
    """A staging folder whose contents move to `folder` when all has gone well, and vanish otherwise.

    Args:
        folder: where results go; made when missing, parents too.
        names: files and folders that will be written.
        marker: the one of them by which an earlier result is known.
        overwrite: whether an earlier result may be replaced; files of other names always stay.

    Raises:
        BadInput: `folder` cannot be used. Raised before anything is computed.
    """
    check_folder(folder, names, marker, overwrite)
    made = [parent for parent in (folder.parent, *folder.parent.parents) if not parent.exists()]
    staging = _stage(folder)
    try:
        yield staging
        _publish(staging, folder)
    except BaseException:
        shutil.rmtree(staging, ignore_errors=True)
        for parent in made:
            with contextlib.suppress(OSError):
                parent.rmdir()
        raise


def check_folder(
    folder: Path,
    names: Sequence[str],
    marker: str,
    overwrite: bool,
    hint: str = "Add --overwrite to replace it, or choose another folder",
) -> None:
    """Whether results may go to a folder; see `results_folder`, and `hint` for what may be done about an earlier one.

    Raises:
        BadInput: they may not.
    """
    for part in (folder, *folder.parents):
        if part.exists() and not part.is_dir():
            raise BadInput("--out", "be a folder", f"{folder}, and {part} is a file")
    taken = [name for name in names if (folder / name).exists()]
    if not taken:
        return
    if not (folder / marker).exists():
        raise BadInput("--out", "be a folder without files of these names", f"{folder}, which has {taken[0]}")
    if not overwrite:
        raise BadInput("--out", "be a folder without an earlier result", f"{folder}, which has {marker}", hint=hint)


def _stage(folder: Path) -> Path:
    """A hidden folder inside `folder` if that exists, else beside it: on the same disk, so that moving is renaming."""
    beside = folder if folder.exists() else folder.parent
    try:
        beside.mkdir(parents=True, exist_ok=True)
        staging = Path(tempfile.mkdtemp(prefix=f".{folder.resolve().name}.", suffix=".partial", dir=beside))
        staging.chmod(0o755)
        return staging
    except OSError as error:
        raise BadInput("--out", "be a folder that can be written", f"{folder}: {error.strerror}") from None


def _publish(staging: Path, folder: Path) -> None:
    if not folder.exists():
        os.replace(staging, folder)
        return
    for new in staging.iterdir():
        old = folder / new.name
        if old.is_dir():
            shutil.rmtree(old)
        os.replace(new, old)
    staging.rmdir()
