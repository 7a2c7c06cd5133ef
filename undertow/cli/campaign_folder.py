"""The folder of a campaign: whether it may be written to, and what is removed from it."""

import shutil
from pathlib import Path

from undertow.campaign.run_campaign import STORE
from undertow.cli import results_folder
from undertow.core.disk import alone
from undertow.core.errors import BadInput

_WRITTEN = (STORE, "campaign.html", "summary.json", "figures", "worst")


def check_folder(folder: Path, resume: bool, overwrite: bool) -> None:
    """That a campaign may be written to a folder.

    Raises:
        BadInput: it may not.
    """
    if resume and overwrite:
        raise BadInput("--resume", "be without --overwrite", "beside it", hint="One goes on, the other begins anew")
    if not resume:
        hint = "Add --resume to go on with it, or --overwrite to begin anew"
        results_folder.check_folder(folder, _WRITTEN, STORE, overwrite, hint)
    elif not (folder / STORE).exists():
        raise BadInput("--resume", "find a campaign to go on with", f"none in {folder}")


def clear_folder(folder: Path) -> None:
    """Leave nothing of a campaign that is replaced.

    Raises:
        BadInput: it is being flown.
    """
    if not folder.exists():
        return
    with alone(folder / STORE):
        for name in _WRITTEN:
            target = folder / name
            shutil.rmtree(target) if target.is_dir() else target.unlink(missing_ok=True)
