"""Tasks side by side: by this process and by further ones, as many as there are cores.

Tracing a program and lowering it are Python, of which a process does one thing at a time; each further process has an
interpreter of its own. Imports no JAX, so that the others start with the command.
"""

import contextlib
import importlib
import os
import pickle
import queue
import subprocess
import sys
import threading
import traceback
import warnings
from collections.abc import Callable, Iterator
from concurrent.futures import CancelledError, Executor, Future, ThreadPoolExecutor
from typing import Any

from undertow.core.process_setup import prepare, python_command

# More processes would wait for each other: the longest tasks take a quarter of the time of all.
_MOST = 4

_own = threading.local()


class _Lost(Exception):
    """A process has ended, or cannot be asked."""


class _Process:
    """A process that computes one task after another."""

    def __init__(self, preload: str):
        self._ended = False
        command, pipe = python_command(f"from {__name__} import serve; serve({preload!r})"), subprocess.PIPE
        # Ctrl-C ends this process, which ends the other one.
        self._process = subprocess.Popen(command, stdin=pipe, stdout=pipe, start_new_session=True)

    def result(self, function: Callable[..., Any], arguments: tuple[Any, ...]) -> Any:
        """Result of a function there; its exception is raised here."""
        request, answer = self._process.stdin, self._process.stdout
        assert request is not None and answer is not None
        try:
            request.write(pickle.dumps((function, arguments)))
            request.flush()
            error, value = pickle.load(answer)  # written by our own process
        except (OSError, EOFError) as lost:
            raise CancelledError if self._ended else _Lost from lost
        if error is not None:
            raise error
        return value

    def end(self) -> None:
        """End it, whatever it does."""
        self._ended = True
        self._process.kill()
        with contextlib.suppress(OSError), self._process:  # closes the pipes and waits
            pass


class _Pool(ThreadPoolExecutor):
    """A thread for each process: the last computes here, each other one asks its process.

    What begins first is computed elsewhere, because this process has further tasks to prepare. Functions are those of
    modules, and their arguments and results can be pickled.
    """

    def __init__(self, processes: list[_Process]):
        free_processes: queue.SimpleQueue[_Process | None] = queue.SimpleQueue()
        for process in (*processes, None):
            free_processes.put(process)
        super().__init__(1 + len(processes), initializer=lambda: setattr(_own, "process", free_processes.get()))

    def submit(self, fn: Callable[..., Any], /, *args: Any, **kwargs: Any) -> Future[Any]:
        assert not kwargs, "arguments are positional"
        return super().submit(_result, fn, args)


def _result(function: Callable[..., Any], arguments: tuple[Any, ...]) -> Any:
    """Result of a task at the place of this thread; here once its process is lost."""
    if _own.process is not None:
        try:
            return _own.process.result(function, arguments)
        except _Lost:
            _own.process = None
    return function(*arguments)


class Tasks:
    """Tasks of an executor, each with words that are shown when it is done.

    Args:
        pool: the executor.
        progress: called with words and the share of the tasks that are done.
    """

    def __init__(self, pool: Executor, progress: Callable[[str, float], None]):
        self._pool, self._progress = pool, progress
        self._submitted, self._done, self._lock = 0, 0, threading.Lock()

    def submit(self, words: str, function: Callable[..., Any], *arguments: Any) -> Future[Any]:
        """Begin a task: a function of a module, with arguments and a result that can be pickled."""
        self._submitted += 1
        future = self._pool.submit(function, *arguments)
        future.add_done_callback(lambda ended: self._show(words, ended))
        return future

    def _show(self, words: str, ended: Future[Any]) -> None:
        with self._lock:
            self._done += 1
            if not ended.cancelled() and ended.exception() is None:
                self._progress(words, self._done / self._submitted)


@contextlib.contextmanager
def worker_processes(count: int | None = None, preload: str = "undertow.simulation.run_many") -> Iterator[Executor]:
    """Executor of tasks, whose functions are those of modules; an error cancels what has not begun.

    Args:
        count: number of processes, this one included; the number of usable cores, up to 4, unless given.
        preload: module that the others import before there is anything to do.
    """
    count = min(_MOST, _cores()) if count is None else count
    processes: list[_Process] = []
    with contextlib.suppress(OSError):  # then there are fewer
        while sys.executable and len(processes) < count - 1:
            processes.append(_Process(preload))
    pool = _Pool(processes)
    try:
        yield pool
    except BaseException:
        pool.shutdown(wait=False, cancel_futures=True)
        raise
    else:
        pool.shutdown()
    finally:
        for process in processes:
            process.end()


def _cores() -> int:
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def serve(preload: str) -> None:
    """Import a module, compute the tasks that standard input names, and write their results to standard output.

    Whatever else is printed goes to standard error.
    """
    answer = os.fdopen(os.dup(1), "wb")
    os.dup2(2, 1)
    if not os.environ.get("UNDERTOW_TRACEBACK"):
        warnings.simplefilter("ignore")
    prepare()
    importlib.import_module(preload)

    with contextlib.suppress(EOFError, BrokenPipeError):
        while True:
            function, arguments = pickle.load(sys.stdin.buffer)
            answer.write(_answer(function, arguments))
            answer.flush()
    os._exit(0)  # JAX would clear its caches for a quarter of a second


def _answer(function: Callable[..., Any], arguments: tuple[Any, ...]) -> bytes:
    """Error or None, and result, pickled."""
    try:
        return pickle.dumps((None, function(*arguments)))
    except Exception as error:
        try:
            pickled = pickle.dumps((error, None))
            pickle.loads(pickled)
        except Exception:  # one that cannot be pickled is passed on as text
            pickled = pickle.dumps((RuntimeError("".join(traceback.format_exception(error))), None))
        return pickled
