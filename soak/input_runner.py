"""Tries hostile inputs one after the other in this process, each in an empty folder, with limits of time and memory."""

import contextlib
import io
import os
import resource
import shutil
import signal
import time
import warnings
from collections.abc import Callable, Mapping, Sequence
from multiprocessing.connection import Connection
from pathlib import Path
from types import FrameType

from soak.inputs import BUILD, KINDS, LINES, Attack, attack
from soak.specimens import SCENARIOS, scenario_files
from soak.verdict import REFUSED, Done

Run = Callable[[Sequence[str]], int]

_MEMORY = 12 * 2**30  # bytes of address space of a process
_LIMIT = 21.0  # s of processor time, for one input
_ONCE = 0.5  # s of processor time, from which on a rejection is tried once more
_KEPT = 20_000  # characters of output


class _Overdue(BaseException):
    """An input takes too long. No Exception, so that nothing that is tried can answer it."""


def try_in_process(run: Run, hostile_input: Attack, folder: Path) -> Done:
    """What an input does in this process.

    Args:
        run: `undertow` with arguments, in this process.
        hostile_input: the input.
        folder: empty, and empty again afterwards.
    """
    write_files(hostile_input.files, folder)
    before = _state(folder)
    out, err = _stream("strict"), _stream("backslashreplace")
    began = time.process_time(), time.monotonic()
    code: int | None = None
    try:
        signal.signal(signal.SIGPROF, _overdue)  # of the whole process: another one's load counts for nothing
        signal.setitimer(signal.ITIMER_PROF, _LIMIT)
        with contextlib.chdir(folder), contextlib.redirect_stdout(out), contextlib.redirect_stderr(err):
            try:
                code = run(hostile_input.arguments)
            finally:
                signal.setitimer(signal.ITIMER_PROF, 0.0)
    except _Overdue:
        code = -1
    except BaseException as error:  # what passes the guard of the command line
        err.write(f"Traceback (most recent call last)\n{type(error).__name__}: {error}\n")
        code = -2
    seconds = time.process_time() - began[0], time.monotonic() - began[1]
    after = _state(folder)
    files_left = [name for name, data in after.items() if before.get(name) != data]
    _empty(folder)
    return Done(code, _text(out), _text(err), seconds, files_left)


def work(run: Run, seed: int, material: Mapping[str, bytes], folder: str, pipe: Connection) -> None:
    """A process that tries inputs: it receives (kind, number) and sends what they did, until it receives None.

    It raises no signal's exception outside of an input, and its memory is limited.
    """
    warnings.simplefilter("ignore")
    resource.setrlimit(resource.RLIMIT_AS, (_MEMORY, _MEMORY))
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    working_folder = Path(folder)
    working_folder.mkdir(parents=True, exist_ok=True)
    for words in LINES:
        try_in_process(run, Attack("", {**scenario_files(SCENARIOS["axis"]), "folder": None}, words), working_folder)
    for kind in KINDS:  # what is imported and compiled once in a process is not what an input takes
        try_in_process(run, attack(kind, -1, 0, material), working_folder)
    for text in SCENARIOS.values():
        try_in_process(run, Attack("", scenario_files(text), (BUILD, "s.yaml")), working_folder)
    with contextlib.suppress(EOFError, BrokenPipeError, KeyboardInterrupt):  # the process that asks has ended
        while (task := pipe.recv()) is not None:
            hostile_input = attack(task[0], seed, task[1], material)
            outcome = try_in_process(run, hostile_input, working_folder)
            # An import or a collection of garbage may have made it slow: once more.
            if outcome.code in REFUSED and outcome.seconds[0] > _ONCE:
                outcome = try_in_process(run, hostile_input, working_folder)
            pipe.send((hostile_input, outcome))


def write_files(files: Mapping[str, bytes | None], folder: Path) -> None:
    """Write the files of a hostile input into a folder; None stands for a folder."""
    for name, data in files.items():
        path = folder / name
        path.parent.mkdir(parents=True, exist_ok=True)
        if data is None:
            path.mkdir(exist_ok=True)
        else:
            path.write_bytes(data)


def _state(folder: Path) -> dict[str, bytes | None]:
    """Bytes of every file, None for a folder; without what Python keeps of modules."""
    contents: dict[str, bytes | None] = {}
    for path in sorted(folder.rglob("*")):
        if "__pycache__" not in path.parts:
            contents[path.relative_to(folder).as_posix()] = path.read_bytes() if path.is_file() else None
    return contents


def _empty(folder: Path) -> None:
    for path in folder.iterdir():
        shutil.rmtree(path) if path.is_dir() and not path.is_symlink() else os.unlink(path)


def _stream(errors: str) -> io.TextIOWrapper:
    """As stdout or stderr of a process: text that cannot be encoded is an error on stdout."""
    return io.TextIOWrapper(io.BytesIO(), encoding="utf-8", errors=errors, write_through=True)


def _text(stream: io.TextIOWrapper) -> str:
    written = stream.buffer.getvalue()  # pyright: ignore[reportAttributeAccessIssue] - a BytesIO
    return written.decode("utf-8", "replace")[-_KEPT:]


def _overdue(number: int, frame: FrameType | None) -> None:
    raise _Overdue
