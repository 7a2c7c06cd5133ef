"""Where a result comes from: versions, machine class, hashes."""

import hashlib
import importlib.metadata
import platform
import sys

import jax
import numpy as np
import xarray as xr

_PACKAGES = ("undertow", "jax", "jaxlib", "equinox", "diffrax", "numpy")


def versions() -> dict[str, str]:
    """Versions of what computes, and the class of machine it ran on."""
    found = {f"version_{name}": importlib.metadata.version(name) for name in _PACKAGES}
    device = jax.devices()[0]
    return found | {
        "version_python": ".".join(map(str, sys.version_info[:3])),
        "machine": f"{platform.system()} {platform.machine()}, {device.platform} ({device.device_kind})",
    }


def text_hash(text: str) -> str:
    """SHA-256 of a text."""
    return hashlib.sha256(text.encode()).hexdigest()


def content_hash(dataset: xr.Dataset) -> str:
    """SHA-256 of every number in a dataset: equal if and only if a run repeated bit for bit."""
    digest = hashlib.sha256()
    for name in sorted(map(str, dataset.variables)):
        values = np.asarray(dataset[name].values)
        if values.dtype.kind in "fiub":
            digest.update(name.encode())
            digest.update(np.ascontiguousarray(values).tobytes())
    return digest.hexdigest()
