"""The checkpoint of a command that can be resumed: kept only when the command is interrupted."""

import contextlib
from collections.abc import Iterator
from pathlib import Path

import typer

from undertow.simulation.checkpoint import has_answers


def unfinished(first: Path, name: str) -> Path:
    """The folder of the last unfinished run of a command.

    Args:
        first: folder of its results; others have numbers after this name.
        name: of the checkpoint.
    """
    begun = [path.parent for path in first.parent.glob(f"{first.name}*/{name}")]
    return max(begun, key=lambda path: (path / name).stat().st_mtime, default=first)


@contextlib.contextmanager
def checkpoint_in(folder: Path, name: str, command: str) -> Iterator[Path]:
    """The checkpoint of a command, kept only when it is interrupted after its first evaluation."""
    existed = folder.exists()
    folder.mkdir(parents=True, exist_ok=True)
    checkpoint = folder / name
    before = checkpoint.exists()
    try:
        yield checkpoint
    except BaseException as error:
        if isinstance(error, KeyboardInterrupt) and has_answers(checkpoint):
            typer.echo(f"Interrupted. To resume: undertow {command} ... --out {folder} --resume", err=True)
        elif not before:
            checkpoint.unlink(missing_ok=True)
            if not existed:
                with contextlib.suppress(OSError):
                    folder.rmdir()
        raise
