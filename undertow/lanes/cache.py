"""Compiled code, kept from one process to the next."""

import hashlib
import os
from collections.abc import Callable
from pathlib import Path


def cache_folder() -> Path:
    """UNDERTOW_CACHE, or `undertow` in the user's folder of caches."""
    told = os.environ.get("UNDERTOW_CACHE")
    return Path(told) if told else Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "undertow"


def kept(told: object, suffix: str, make: Callable[[], bytes]) -> bytes:
    """Result of `make`, or what it was in an earlier process.

    Args:
        told: everything that it depends on; by its `repr`.
        suffix: of the file.
        make: what makes it.
    """
    path = cache_folder() / f"{hashlib.sha256(repr(told).encode()).hexdigest()}{suffix}"
    try:
        return path.read_bytes()
    except OSError:
        pass
    made = make()
    try:  # a cache that cannot be written is none
        path.parent.mkdir(parents=True, exist_ok=True)
        part = path.with_suffix(f".{os.getpid()}")
        part.write_bytes(made)
        part.replace(path)
    except OSError:
        pass
    return made
