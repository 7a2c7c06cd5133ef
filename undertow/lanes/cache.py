"""Where compiled code is kept, from one process to the next."""

import hashlib
import os
import platform
from pathlib import Path


def cache_folder() -> Path:
    """UNDERTOW_CACHE, or `undertow` in the user's folder of caches."""
    told = os.environ.get("UNDERTOW_CACHE")
    return Path(told) if told else Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "undertow"


def keep_xla_code() -> None:
    """Let XLA keep its code, too, unless JAX was told of a place already; before JAX is imported.

    The code is for one kind of processor: machines that share a home folder have a folder each.
    """
    folder = cache_folder() / f"xla-{_processor()}"
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError:
        return
    os.environ.setdefault("JAX_COMPILATION_CACHE_DIR", str(folder))
    os.environ.setdefault("JAX_PERSISTENT_CACHE_MIN_COMPILE_TIME_SECS", "0")
    os.environ.setdefault("JAX_PERSISTENT_CACHE_MIN_ENTRY_SIZE_BYTES", "0")


def _processor() -> str:
    try:
        features = next(line for line in Path("/proc/cpuinfo").read_text().splitlines() if line.startswith("flags"))
    except (OSError, StopIteration):
        features = platform.processor()
    return hashlib.sha256(f"{platform.machine()} {features}".encode()).hexdigest()[:12]
