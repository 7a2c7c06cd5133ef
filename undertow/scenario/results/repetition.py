"""A run compared with the result file from which it was repeated, and result files that hold a part of a run."""

from collections.abc import Collection
from pathlib import Path
from typing import NamedTuple

import xarray as xr

from undertow.logs.result_file import opened_result
from undertow.scenario.foreign_code import changed
from undertow.scenario.provenance import checksum, claims
from undertow.scenario.reading import parse

_LEFT_OUT = "left_out"  # attribute of a result: series that the run had and the file has not
_SHOWN = 3  # of what differs


def shortened(dataset: xr.Dataset, names: Collection[str]) -> xr.Dataset:
    """A result with some of its series only, to be written compressed; no number is changed.

    Its content hash stays that of the whole run, so that a repetition is compared with all of it.

    Args:
        dataset: of the run.
        names: of series; those that the run has not are ignored.
    """
    left_out = sorted(str(name) for name in dataset.data_vars if name not in names)
    reduced = dataset.drop_vars(left_out).copy()
    for variable in reduced.variables.values():
        if variable.dtype.kind in "fi":
            variable.encoding = {"zlib": True, "shuffle": True, "complevel": 4}
    reduced.attrs[_LEFT_OUT] = ", ".join(left_out)
    reduced.attrs["checksum"] = checksum(reduced)
    return reduced


class Repetition(NamedTuple):
    """A run compared with the result file it was repeated from."""

    equal: bool
    explained: bool  # whether other versions or changed code explain a difference
    sentence: str


def compare(path: Path, repeated: xr.Dataset) -> Repetition:
    """Compare a run with the result file at `path`, whose scenario it used and whose checksum, if any, is correct."""
    with opened_result(path) as earlier:
        before, earlier_claims = dict(earlier.attrs), claims(earlier)
    repeated_claims, left_out = claims(repeated), set(before.get(_LEFT_OUT, "").split(", "))
    differing = [name for name, claim in earlier_claims.items() if repeated_claims.get(name) != claim]
    added = sorted(set(repeated_claims) - set(earlier_claims) - left_out)
    if _LEFT_OUT in before and not differing and not added and before["content_hash"] != repeated.attrs["content_hash"]:
        differing = ["series that it has left out"]
    code = _code(path, before)
    if not differing:
        which = f"in all its contents; new since then: {_listed(added)}" if added else _short(repeated)
        though = f", although {code}" if code else ""
        unknown = "" if "checksum" in before else "; it has no checksum that could reveal changes to the file"
        return Repetition(True, True, f"{path.name} was repeated bit for bit {which}{though}{unknown}")
    causes = [_differences(before, repeated.attrs), code, f"one without {_listed(added)}" if added else ""]
    reasons = ", ".join(filter(None, causes))
    why = f"; other versions: {reasons}" if reasons else ", with the same versions"
    return Repetition(
        False, bool(reasons), f"{path.name} was not repeated bit for bit{why}. Differences: {_listed(differing)}"
    )


def _short(repeated: xr.Dataset) -> str:
    return f"(content hash {repeated.attrs['content_hash'][:12]})"


def _listed(names: list[str]) -> str:
    return ", ".join(names[:_SHOWN]) + (f" and {len(names) - _SHOWN} more" if names[_SHOWN:] else "")


def _code(path: Path, before: dict) -> str:
    """Code files that have changed."""
    scenario = parse(str(before.get("scenario") or "{}"), path.name, path.resolve().parent)
    files = changed(before.get("code"), scenario.data, scenario.folder)
    return ", ".join(f"{file} has changed" for file in files)


def _differences(before: dict, after: dict) -> str:
    names = sorted(name for name in {*before, *after} if name.startswith("version_") or name == "machine")
    changed = [name for name in names if before.get(name) != after.get(name)]
    return ", ".join(
        f"{name.removeprefix('version_')} {before.get(name)} then, {after.get(name)} now" for name in changed
    )
