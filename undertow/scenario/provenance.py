"""Provenance of a result: versions, machine class, code files; and checksums that reveal changes."""

import functools
import hashlib
import importlib.metadata
import json
import platform
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import jax
import numpy as np
import xarray as xr

_PACKAGES = ("undertow", "jax", "jaxlib", "equinox", "diffrax", "numpy")

# Attributes of a result that are results themselves; those in JSON are compared one by one.
_CLAIMED = ("status", "ended", "certificate", "transitions")
_CLAIMED_EACH = "metrics"

_PART = 2**22  # bytes that are read and hashed at once


def versions() -> dict[str, str]:
    """Versions of the software, and the class of the machine."""
    device = jax.devices()[0]
    return _packages() | {
        "version_python": ".".join(map(str, sys.version_info[:3])),
        "machine": f"{platform.system()} {platform.machine()}, {device.platform} ({device.device_kind})",
    }


@functools.cache
def _packages() -> dict[str, str]:
    return {f"version_{name}": importlib.metadata.version(name) for name in _PACKAGES}


def text_hash(text: str) -> str:
    """SHA-256 of a text."""
    return hashlib.sha256(text.encode()).hexdigest()


def claims(dataset: xr.Dataset) -> dict[str, str]:
    """SHA-256 of every result of a run: columns, status, and each metric as `metrics.whole...`.

    They are equal if and only if the runs are identical bit for bit. Versions, machine and texts are not included.
    """
    hashes = {str(name): _of_values(dataset[name].variable) for name in dataset.variables}
    hashes |= {name: _of_words(dataset.attrs[name]) for name in _CLAIMED if name in dataset.attrs}
    leaves = _leaves(json.loads(dataset.attrs.get(_CLAIMED_EACH, "{}")), _CLAIMED_EACH)
    return hashes | {name: _of_words(value) for name, value in leaves}


def content_hash(dataset: xr.Dataset) -> str:
    """SHA-256 of all results of a run: equal if and only if the runs are identical bit for bit."""
    return text_hash(json.dumps(claims(dataset), sort_keys=True))


def checksum(dataset: xr.Dataset) -> str:
    """SHA-256 of a whole result, including units and scenario; equal to its attribute `checksum` if it is unchanged.

    It reveals damage and edits. It is not a signature: whoever changes a file on purpose can compute another one.
    """
    attributes = {"": {key: value for key, value in dataset.attrs.items() if key != "checksum"}}
    attributes |= {str(name): dict(variable.attrs) for name, variable in dataset.variables.items()}
    words = {}
    for name, attributes_of_one in attributes.items():
        words[name] = {key: _plain(value) for key, value in attributes_of_one.items()}
    return text_hash(json.dumps([claims(dataset), words], sort_keys=True))


def file_hash(path: Path) -> str:
    """SHA-256 of the contents of a file; empty where it cannot be read."""
    try:
        return hashlib.sha256(path.read_bytes()).hexdigest()
    except OSError:
        return ""


def recording_hash(path: Path) -> str:
    """SHA-256 of a file, or of all files of a folder, such as a bag of ROS 2, in the order of their names.

    Raises:
        OSError: it cannot be read.
    """
    digest = hashlib.sha256()
    files = sorted(path.rglob("*")) if path.is_dir() else [path]
    for file in (file for file in files if file.is_file()):
        with file.open("rb") as stream:
            while block := stream.read(_PART):
                digest.update(block)
    return digest.hexdigest()


def _of_values(variable: xr.Variable) -> str:
    numbers = variable.dtype.kind in "fiub"
    form = [*map(str, variable.dims), *map(str, variable.shape), variable.dtype.str if numbers else "text"]
    digest = hashlib.sha256("\0".join(form).encode())
    if not numbers:
        digest.update("\0".join(map(str, np.asarray(variable.values).flat)).encode())
        return digest.hexdigest()
    for part in _parts(variable):
        digest.update(np.ascontiguousarray(part.values).tobytes())
    return digest.hexdigest()


def _parts(variable: xr.Variable) -> Iterator[xr.Variable]:
    """A variable in parts along its first axis, so that one in a file is never read whole."""
    if not variable.ndim or variable.nbytes <= _PART:
        yield variable
        return
    rows = max(1, _PART * variable.shape[0] // variable.nbytes)
    for first in range(0, variable.shape[0], rows):
        yield variable[first : first + rows]


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
