"""Whether a result file was repeated bit for bit, and if not, why that may be."""

from pathlib import Path
from typing import NamedTuple

import xarray as xr

from undertow.scenario.provenance import content_hash


class Repetition(NamedTuple):
    """A run compared with the result file it was repeated from."""

    equal: bool
    explained: bool  # whether a difference has a reason other than a broken promise
    sentence: str


def compare(path: Path, repeated: xr.Dataset) -> Repetition:
    """Compare a run with the result file at `path`, whose scenario it followed."""
    with xr.open_dataset(path, engine="netcdf4") as earlier:
        before, actual, held = dict(earlier.attrs), content_hash(earlier), set(map(str, earlier.variables))
    stated = str(before.get("content_hash"))
    if actual != stated:
        return Repetition(
            False, False, f"{path.name} was changed after it was written: its numbers do not match its hash"
        )
    if stated == repeated.attrs["content_hash"]:
        return Repetition(True, True, f"{path.name} was repeated bit for bit (content hash {stated[:12]})")
    added = sorted({str(name) for name in repeated.variables} - held)
    if added and stated == content_hash(repeated.drop_vars(added)):
        sentence = f"{path.name} was repeated bit for bit in all that it holds; new since then: {', '.join(added)}"
        return Repetition(True, True, sentence)
    differing = _differences(before, repeated.attrs)
    if added:
        differing = ", ".join(filter(None, [differing, f"one without {', '.join(added)}"]))
    if differing:
        return Repetition(False, True, f"{path.name} was not repeated bit for bit; other versions: {differing}")
    hint = " Did its part file change?" if ".py:" in str(before.get("scenario")) else ""
    return Repetition(False, False, f"{path.name} was not repeated bit for bit, with the same versions.{hint}")


def _differences(before: dict, now: dict) -> str:
    names = sorted(name for name in {*before, *now} if name.startswith("version_") or name == "machine")
    changed = [name for name in names if before.get(name) != now.get(name)]
    return ", ".join(
        f"{name.removeprefix('version_')} {before.get(name)} then, {now.get(name)} now" for name in changed
    )
