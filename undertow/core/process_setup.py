"""Set-up of a process that is undertow's own: the command line, a test run, a benchmark. Imports no JAX."""

import atexit
import contextlib
import gc
import hashlib
import importlib.metadata
import json
import os
import platform
import random
import stat
import sys
import time
from pathlib import Path

# XLA compiles the body of a small `while` loop into one plain function instead of a list of kernels to be
# dispatched one by one. Its own limit (1 kB of loop state) is below a vehicle with its thrusters; with the limit
# raised, one step of the closed loop takes a quarter of the time.
_ONE_FUNCTION_PER_LOOP = "xla_cpu_small_while_loop_byte_threshold=100000000"

# LLVM's first level compiles in four fifths of the time of its third one, and the code is as fast.
_OPTIMIZATION = 1

# With the fusion emitters of XLA in JAX 0.10 a program of eight references put the way-points metres away
# (tests/numerics/test_xla_flags.py). Without them it compiles in half the time as well. Later versions have no others.
_WRONG_EMITTERS = "0.10."

# Names of the entries of the cache of XLA, and of the file with their checksums; s that comparing them may take.
_ENTRY, _CHECKSUMS, _LONGEST_CHECK = "-cache", "checksums.json", 0.05

_OTHERS_MAY_WRITE = stat.S_IWGRP | stat.S_IWOTH

# Objects before the youngest are looked through. Tracing makes millions that live: Python's 700 cost half a second.
_YOUNG, _MIDDLE, _OLD = 1_000_000, 20, 100


# Set for this process and those that it starts where its code changes nothing of undertow.
KEEP_PROGRAMS = "UNDERTOW_KEEP_PROGRAMS"


def prepare(keep_programs: bool = False) -> None:
    """Set this process up as the commands do: double precision, quick compilation, compiled code that is kept.

    It sets the environment variables of JAX, XLA and OpenBLAS, and looks for garbage seldom. Call it at the top of a
    script, before anything else imports JAX or SciPy: later, only the precision changes. Whoever calls this decides
    about the whole process, so nothing calls it at import. A caller's own settings stay.

    Args:
        keep_programs: whether compiled programs are kept and found by this process although it has code of its own, a
            script or a notebook: it then starts as quickly as a command. For code that changes nothing inside of
            undertow or JAX: a function of theirs that it replaces could stay what it was. Parts of one's own are
            compiled anew in any case.
    """
    if keep_programs:
        os.environ[KEEP_PROGRAMS] = "1"
    # Or XLA says on the terminal that compiling is slow, and asks for a bug report.
    os.environ.setdefault("TF_CPP_MIN_LOG_LEVEL", "3")
    stated = "JAX_ENABLE_X64" in os.environ
    os.environ.setdefault("JAX_ENABLE_X64", "1")
    if "jax" in sys.modules and not stated:
        sys.modules["jax"].config.update("jax_enable_x64", True)
    # Matrices here have at most some hundred rows; threads that wait for each other made them ten times as slow.
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    _set_xla_flags()
    _keep_xla_code()
    gc.set_threshold(_YOUNG, _MIDDLE, _OLD)
    atexit.register(gc.freeze)  # or Python looks through everything once more before it goes: half a second


def python_command(code: str) -> list[str]:
    """Command of another Python that runs some code, with the imports that this one has.

    It has the same search path, but not the current folder in front, where a file may have the name of a module.
    """
    return [sys.executable, "-c", f"import sys; sys.path[:] = {sys.path!r}; {code}"]


def _set_xla_flags() -> None:
    flags = os.environ.get("XLA_FLAGS", "")
    ours: dict[str, object] = {"xla_backend_extra_options": _ONE_FUNCTION_PER_LOOP}
    ours["xla_backend_optimization_level"] = _OPTIMIZATION
    if importlib.metadata.version("jax").startswith(_WRONG_EMITTERS):
        ours["xla_cpu_use_fusion_emitters"] = "false"
    further = [f"--{flag}={value}" for flag, value in ours.items() if flag not in flags]
    os.environ["XLA_FLAGS"] = " ".join([flags, *further]).strip()


def _keep_xla_code() -> None:
    """Let XLA keep its code, unless a folder is already set.

    The code is for one kind of processor: machines that share a home folder have a folder each. It is run as the
    user, and XLA asks nobody whose it is: where others may write there, nothing is kept. Nor does it notice damage.
    """
    try:
        folder = _private_folder(f"xla-{processor()}")
        remove_damaged(folder)
    except OSError:
        return
    os.environ.setdefault("JAX_COMPILATION_CACHE_DIR", str(folder))
    os.environ.setdefault("JAX_PERSISTENT_CACHE_MIN_COMPILE_TIME_SECS", "0")
    os.environ.setdefault("JAX_PERSISTENT_CACHE_MIN_ENTRY_SIZE_BYTES", "0")


def remove_damaged(folder: Path, limit: float = _LONGEST_CHECK) -> None:
    """Remove entries of the cache of XLA whose bytes are not those that an earlier process found there.

    XLA runs a damaged entry, which may crash, and JAX lets nobody look at what it reads. So the checksum of an entry is
    noted when a process begins and finds it for the first time, and compared whenever a later one begins.

    Args:
        folder: of the cache.
        limit: s, after which further entries are left as they are; which ones changes from time to time.

    Raises:
        OSError: nothing can be read or written there.
    """
    recorded = _noted(folder / _CHECKSUMS)
    end = time.monotonic() + limit
    entries = [entry.path for entry in os.scandir(folder) if entry.name.endswith(_ENTRY)]
    random.shuffle(entries)
    checksums = dict(recorded)
    for path in entries:
        if time.monotonic() > end:
            break
        name = os.path.basename(path)
        with contextlib.suppress(FileNotFoundError):  # another process has removed it
            digest = hashlib.sha256(Path(path).read_bytes()).hexdigest()
            if recorded.get(name, digest) != digest:
                os.unlink(path)
                del checksums[name]
            else:
                checksums[name] = digest
    if checksums != recorded:
        _note(checksums, folder / _CHECKSUMS)


def _noted(path: Path) -> dict[str, str]:
    """Checksums of entries by their names; none where the file is missing or damaged."""
    try:
        checksums = json.loads(path.read_bytes())
    except (OSError, ValueError):
        return {}
    return checksums if isinstance(checksums, dict) else {}


def _note(checksums: dict[str, str], path: Path) -> None:
    """A loss of the file costs nothing but one comparison: it need not survive a power cut."""
    new = path.with_name(f"{path.name}.{os.getpid()}")
    new.write_text(json.dumps(checksums), encoding="utf-8")
    os.replace(new, path)


def cache_folder() -> Path:
    """UNDERTOW_CACHE, or `undertow` in the user's folder of caches."""
    folder = os.environ.get("UNDERTOW_CACHE")
    return Path(folder) if folder else Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "undertow"


def _private_folder(name: str) -> Path:
    """A folder of the cache; made where there is none.

    Raises:
        OSError: it cannot be made, or belongs to somebody else, or others may write to it.
    """
    folder = cache_folder() / name
    folder.parent.mkdir(parents=True, exist_ok=True)
    with contextlib.suppress(FileExistsError):
        folder.mkdir(mode=0o700)
    status = os.lstat(folder)
    open_to_others = hasattr(os, "geteuid") and (status.st_uid != os.geteuid() or status.st_mode & _OTHERS_MAY_WRITE)
    if open_to_others or not stat.S_ISDIR(status.st_mode):
        raise OSError(f"somebody else may write to {folder}")
    return folder


def processor() -> str:
    """Name of the kind of this processor, by its instructions."""
    try:
        features = next(line for line in Path("/proc/cpuinfo").read_text().splitlines() if line.startswith("flags"))
    except (OSError, StopIteration):
        features = platform.processor()
    return hashlib.sha256(f"{platform.machine()} {features}".encode()).hexdigest()[:12]
