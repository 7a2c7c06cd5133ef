"""Set-up of a process that is undertow's own: the command line, a test run, a benchmark. Imports no JAX."""

import atexit
import gc
import hashlib
import os
import platform
from pathlib import Path

from simdjit.cache import private_folder

# Objects before the youngest are looked through. Tracing makes millions that live: Python's 700 cost half a second.
_YOUNG, _MIDDLE, _OLD = 50_000, 20, 100


def prepare() -> None:
    """Keep compiled code from one process to the next, and look for garbage seldom; before JAX is imported."""
    # Or XLA says on the terminal that compiling is slow, and asks for a bug report.
    os.environ.setdefault("TF_CPP_MIN_LOG_LEVEL", "3")
    _keep_xla_code()
    gc.set_threshold(_YOUNG, _MIDDLE, _OLD)
    atexit.register(gc.freeze)  # or Python looks through everything once more before it goes: half a second


def _keep_xla_code() -> None:
    """Let XLA keep its code, unless a folder is already set.

    The code is for one kind of processor: machines that share a home folder have a folder each. It is run as the
    user, and XLA asks nobody whose it is: where others may write there, nothing is kept.
    """
    try:
        folder = private_folder(f"xla-{_processor()}")
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
