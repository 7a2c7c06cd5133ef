"""The process in which link commands run, one after the other: signals go to it, and it may be killed."""

import contextlib
import multiprocessing
import os
import resource
import signal
import sys
import threading
import time
from collections.abc import Callable, Sequence
from multiprocessing.connection import Connection
from pathlib import Path
from typing import Any

from soak.input_runner import Run

_CONTINUES = 10.0  # s, longest wait for the end of a command after its last signal


class CommandProcess:
    """A process that runs `undertow` with arguments, and says how each call ended; a new one where it was killed.

    Args:
        run: `undertow` with arguments, in the process that calls it.
        folder: for what it prints.
    """

    def __init__(self, run: Run, folder: Path):
        self._run = run
        self._printed = folder / "printed.txt"
        self._process: Any = None

    def begin(self, arguments: Sequence[str], disk: int | None = None) -> None:
        """Call `undertow`; no file may become larger than `disk` bytes, None for any size."""
        if self._process is None or not self._process.is_alive():
            context = multiprocessing.get_context("spawn")
            self._pipe, child_pipe = context.Pipe()
            self._process = context.Process(
                target=_serve, args=(self._run, child_pipe, str(self._printed)), daemon=False
            )
            self._process.start()
            child_pipe.close()
        self._printed.write_bytes(b"")
        self._pipe.send((list(arguments), disk))
        self._code: int | None = None

    def send(self, number: int) -> None:
        """Send a signal."""
        assert self._process is not None and self._process.pid is not None
        with contextlib.suppress(ProcessLookupError):
            os.kill(self._process.pid, number)

    def code(self) -> int | None:
        """Exit code of the call, or -N where the process died by signal N; None while it runs."""
        assert self._process is not None
        if self._code is None:
            try:
                self._code = self._pipe.recv() if self._pipe.poll() else None
            except (EOFError, ConnectionError):
                self._process.join(_CONTINUES)  # until it is gone, or the next call would be given to it
                self._code = self._process.exitcode if self._process.exitcode is not None else -signal.SIGKILL
        return self._code

    def wait(self, longest: float = _CONTINUES) -> int | None:
        """The exit code; None where it takes longer, s."""
        until = time.monotonic() + longest
        while self.code() is None and time.monotonic() < until:
            time.sleep(0.005)
        return self._code

    def printed(self) -> str:
        """What the call wrote to stdout and stderr."""
        return self._printed.read_text(encoding="utf-8", errors="replace")

    def kill(self) -> None:
        """End the process, whatever it does."""
        if self._process is not None and self._process.is_alive():
            self.send(signal.SIGKILL)
            self._process.join()
        self._process = None


def end_with_parent() -> None:
    """End this process by SIGTERM when the one that started it is gone: nobody else would."""
    parent = multiprocessing.parent_process()
    assert parent is not None

    def wait() -> None:
        parent.join()
        os.kill(os.getpid(), signal.SIGTERM)
        time.sleep(_CONTINUES)
        os.kill(os.getpid(), signal.SIGKILL)

    threading.Thread(target=wait, daemon=True).start()


def _serve(run: Run, pipe: Connection, printed: str) -> None:
    """Run what is asked for until nobody asks any more."""
    end_with_parent()
    out = os.open(printed, os.O_WRONLY | os.O_APPEND | os.O_CREAT, 0o600)
    os.dup2(out, 1)
    os.dup2(out, 2)
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    # As in a terminal: a stress test may run under `nohup`, or in the background of a script.
    signal.signal(signal.SIGHUP, signal.SIG_DFL)
    signal.signal(signal.SIGINT, signal.default_int_handler)
    while (request := _patiently(pipe.recv)) is not None:
        arguments, disk = request
        most = resource.getrlimit(resource.RLIMIT_FSIZE)[1]
        resource.setrlimit(resource.RLIMIT_FSIZE, (most if disk is None else disk, most))
        code = run(arguments)
        with contextlib.suppress(OSError):  # a full disk
            sys.stdout.flush()
        resource.setrlimit(resource.RLIMIT_FSIZE, (most, most))
        _patiently(lambda code=code: pipe.send(code))


def _patiently(act: Callable):
    """Do something although a signal comes late; None where nobody is at the other end any more."""
    while True:
        try:
            return act()
        except KeyboardInterrupt:
            continue
        except (EOFError, ConnectionError):
            return None
