"""Provenance of a result: versions, machine class, code files; and checksums that reveal changes."""

import hashlib
import importlib.metadata
import json
import platform
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any, NamedTuple

import jax
import numpy as np
import xarray as xr

from undertow.scenario.foreign_code import changed
from undertow.scenario.reading import parse

_PACKAGES = ("undertow", "jax", "jaxlib", "equinox", "diffrax", "numpy")

# Attributes of a result that are results themselves; those in JSON are compared one by one.
_CLAIMED = ("status", "ended", "certificate")
_CLAIMED_EACH = "metrics"


def versions() -> dict[str, str]:
    """Versions of the software, and the class of the machine."""
    found = {f"version_{name}": importlib.metadata.version(name) for name in _PACKAGES}
    device = jax.devices()[0]
    return found | {
        "version_python": ".".join(map(str, sys.version_info[:3])),
        "machine": f"{platform.system()} {platform.machine()}, {device.platform} ({device.device_kind})",
    }


def text_hash(text: str) -> str:
    """SHA-256 of a text."""
    return hashlib.sha256(text.encode()).hexdigest()


def claims(dataset: xr.Dataset) -> dict[str, str]:
    """SHA-256 of every result of a run: columns, status, and each metric as `metrics.whole...`.

    They are equal if and only if the runs are identical bit for bit. Versions, machine and texts are not included.
    """
    found = {str(name): _of_values(dataset[name].variable) for name in dataset.variables}
    found |= {name: _of_words(dataset.attrs[name]) for name in _CLAIMED if name in dataset.attrs}
    each = _leaves(json.loads(dataset.attrs.get(_CLAIMED_EACH, "{}")), _CLAIMED_EACH)
    return found | {name: _of_words(value) for name, value in each}


def content_hash(dataset: xr.Dataset) -> str:
    """SHA-256 of all results of a run: equal if and only if the runs are identical bit for bit."""
    return text_hash(json.dumps(claims(dataset), sort_keys=True))


def checksum(dataset: xr.Dataset) -> str:
    """SHA-256 of a whole result, including units and scenario; equal to its attribute `checksum` if it is unchanged.

    It reveals damage and edits. It is not a signature: whoever changes a file on purpose can compute another one.
    """
    attributes = {"": {key: value for key, value in dataset.attrs.items() if key != "checksum"}}
    attributes |= {str(name): dict(variable.attrs) for name, variable in dataset.variables.items()}
    words = {name: {key: _plain(value) for key, value in each.items()} for name, each in attributes.items()}
    return text_hash(json.dumps([claims(dataset), words], sort_keys=True))


def file_hash(path: Path) -> str:
    """SHA-256 of the contents of a file; empty where it cannot be read."""
    try:
        return hashlib.sha256(path.read_bytes()).hexdigest()
    except OSError:
        return ""


def _of_values(variable: xr.Variable) -> str:
    values = np.asarray(variable.values)
    numbers = values.dtype.kind in "fiub"
    form = [*map(str, variable.dims), *map(str, values.shape), values.dtype.str if numbers else "text"]
    digest = hashlib.sha256("\0".join(form).encode())
    digest.update(np.ascontiguousarray(values).tobytes() if numbers else "\0".join(map(str, values.flat)).encode())
    return digest.hexdigest()


def _of_words(value: Any) -> str:
    return text_hash(json.dumps(_plain(value)))


def _plain(value: Any) -> Any:
    """An attribute as netCDF gives it back: a list of one entry is the entry itself."""
    entries = np.asarray(value).ravel().tolist() if not isinstance(value, str) else [value]
    return entries[0] if len(entries) == 1 else entries


def _leaves(node: Any, path: str) -> Iterator[tuple[str, Any]]:
    if not isinstance(node, dict):
        yield path, "null" if node is None else node
        return
    for key, value in node.items():
        yield from _leaves(value, f"{path}.{key}")


_SHOWN = 3  # of what differs


class Repetition(NamedTuple):
    """A run compared with the result file it was repeated from."""

    equal: bool
    explained: bool  # whether other versions or changed code explain a difference
    sentence: str


def compare(path: Path, repeated: xr.Dataset) -> Repetition:
    """Compare a run with the result file at `path`, whose scenario it used and whose checksum, if any, is correct."""
    with xr.open_dataset(path, engine="netcdf4") as earlier:
        before, held = dict(earlier.attrs), claims(earlier)
    now = claims(repeated)
    differing, added = [name for name, claim in held.items() if now.get(name) != claim], sorted(set(now) - set(held))
    code = _code(path, before)
    if not differing:
        which = f"in all its contents; new since then: {_listed(added)}" if added else _short(repeated)
        though = f", although {code}" if code else ""
        unknown = "" if "checksum" in before else "; it has no checksum that could reveal changes to the file"
        return Repetition(True, True, f"{path.name} was repeated bit for bit {which}{though}{unknown}")
    others = [_differences(before, repeated.attrs), code, f"one without {_listed(added)}" if added else ""]
    reasons = ", ".join(filter(None, others))
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
    scenario = parse(str(before.get("scenario") or "{}"), path.name, path.resolve().parent, "SCENARIO")
    files = changed(before.get("code"), scenario.data, scenario.folder)
    return ", ".join(f"{file} has changed" for file in files)


def _differences(before: dict, now: dict) -> str:
    names = sorted(name for name in {*before, *now} if name.startswith("version_") or name == "machine")
    changed = [name for name in names if before.get(name) != now.get(name)]
    return ", ".join(
        f"{name.removeprefix('version_')} {before.get(name)} then, {now.get(name)} now" for name in changed
    )
