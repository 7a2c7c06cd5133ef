"""Checks and cleans the results folder of a campaign."""

import shutil
from pathlib import Path

from undertow.campaign.run_campaign import STORE
from undertow.cli import results_folder
from undertow.core.disk import alone
from undertow.core.errors import BadInput

_WRITTEN = (STORE, "campaign.html", "summary.json", "figures", "worst")


def check_folder(folder: Path, resume: bool, overwrite: bool) -> None:
    """Check that a campaign may be written to a folder.

    Raises:
        BadInput: the folder cannot be used.
    """
    if resume and overwrite:
        hint = "--resume continues the campaign, --overwrite replaces it"
        raise BadInput("--resume", "be without --overwrite", "given together with it", hint=hint)
    if not resume:
        hint = "Add --resume to continue it, or --overwrite to replace it"
        results_folder.check_folder(folder, _WRITTEN, STORE, overwrite, hint)
    elif not (folder / STORE).exists():
        raise BadInput("--resume", "find a campaign to continue", f"none in {folder}")


def clear_folder(folder: Path) -> None:
    """Remove all files of a campaign that is replaced.

    Raises:
        BadInput: another process is running it.
    """
    if not folder.exists():
        return
    with alone(folder / STORE):
        for name in _WRITTEN:
            target = folder / name
            shutil.rmtree(target) if target.is_dir() else target.unlink(missing_ok=True)
