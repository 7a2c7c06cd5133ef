"""Waiting for compiled code in a way that Ctrl-C can end."""

import signal
import threading
from collections.abc import Callable
from types import FrameType
from typing import TypeVar

Result = TypeVar("Result")

_asked = threading.Event()


def remember_interrupts() -> None:
    """From now on a Ctrl-C that compiled code swallows on its way up ends the next wait all the same.

    While modules are imported it waits for that: an exception leaves half of them, and compiled ones crash then.
    """

    def handler(number: int, frame: FrameType | None) -> None:
        _asked.set()
        if not _importing(frame):
            signal.default_int_handler(number, frame)

    signal.signal(signal.SIGINT, handler)


def _importing(frame: FrameType | None) -> bool:
    while frame is not None and not frame.f_code.co_filename.startswith("<frozen importlib"):
        frame = frame.f_back
    return frame is not None


def interruptible(work: Callable[[], Result]) -> Result:
    """Result of `work`, or what it raises. It runs in a thread: compiled code does not hear Ctrl-C, waiting does."""
    results: list[Result] = []
    errors: list[BaseException] = []

    def run() -> None:
        try:
            results.append(work())
        except BaseException as error:
            errors.append(error)

    thread = threading.Thread(target=run, daemon=True)
    thread.start()
    while thread.is_alive():
        if _asked.is_set():
            raise KeyboardInterrupt
        thread.join(0.1)
    if errors:
        raise errors[0]
    return results[0]
