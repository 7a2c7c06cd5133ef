"""End a command at once on a signal that ends it, also while modules are imported or compiled code runs."""

import contextlib
import os
import signal
import threading
import time
from collections.abc import Callable, Iterator
from types import FrameType
from typing import TypeVar

Result = TypeVar("Result")

# Ctrl-C, `kill`, the end of the terminal or of an ssh connection, and Ctrl-\\.
_ENDING = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP, signal.SIGQUIT)

BY_SIGNAL = 128  # and the number of the signal: exit code of a command that one ends

_AGAIN = 0.05  # s, until the next look whether modules are still being imported
_STUCK = 5.0  # s, for which a loop may not have looked for a signal
_LONGEST = 20.0  # s, longest wait for an import: a user's file may never end

_asked: list[tuple[int, float]] = []  # the signals received, with their times


def remember_interrupts() -> None:
    """Make the signals that end a command raise KeyboardInterrupt, and remember one that compiled code swallows.

    The first one is answered by a line on stderr. During an import the exception waits until it ends: a half-imported
    compiled module crashes.
    """
    for ending_signal in ending_signals():
        signal.signal(ending_signal, _handler)
    signal.signal(signal.SIGALRM, _handler)


def ending_signals() -> list[signal.Signals]:
    """The signals that end a command: all but what `nohup` switched off."""
    return [
        ending_signal
        for ending_signal in _ENDING
        if ending_signal != signal.SIGHUP or signal.getsignal(ending_signal) != signal.SIG_IGN
    ]


def forget_interrupts() -> None:
    """As if no signal had come, where another command begins in the same process."""
    signal.setitimer(signal.ITIMER_REAL, 0.0)
    _asked.clear()


def interrupted_by() -> int:
    """Number of the signal that ends this process; that of Ctrl-C by default."""
    return _asked[0][0] if _asked else signal.SIGINT


def raise_if_interrupted() -> None:
    """Raise KeyboardInterrupt for a signal that still waits for modules to be imported; none comes later."""
    signal.setitimer(signal.ITIMER_REAL, 0.0)
    if _asked:
        raise KeyboardInterrupt


def _handler(number: int, frame: FrameType | None) -> None:
    if number != signal.SIGALRM:
        if not _asked:
            os.write(2, b"\nInterrupted: stopping.\n")  # not buffered, so that it appears at once
        _asked.append((number, time.monotonic()))
    if _importing(frame) and time.monotonic() - _asked[0][1] < _LONGEST:
        signal.setitimer(signal.ITIMER_REAL, _AGAIN)
    else:
        raise KeyboardInterrupt


def _importing(frame: FrameType | None) -> bool:
    while frame is not None and not frame.f_code.co_filename.startswith("<frozen importlib"):
        frame = frame.f_back
    return frame is not None


class EndingSignal:
    """The signal that asks a loop for its end.

    Attributes:
        number: of the first one; 0 before.
    """

    def __init__(self) -> None:
        self.number, self._looked = 0, time.monotonic()

    @property
    def exit_code(self) -> int:
        """That of a command which it ends; 0 without one."""
        return BY_SIGNAL + self.number if self.number else 0

    def asked(self) -> bool:
        """Whether one has come; a loop that has not looked for 5 s is interrupted instead."""
        self._looked = time.monotonic()
        return self.number != 0

    @contextlib.contextmanager
    def listening(self) -> Iterator[None]:
        """Inside, signals do not raise: the loop asks, and ends with its safe output."""
        self._looked = time.monotonic()

        def note(number: int, frame: FrameType | None) -> None:
            if not self.number:
                self.number = number
                with contextlib.suppress(OSError):  # nobody reads it: the terminal is gone, or the pipe closed
                    os.write(2, b"\nInterrupted: stopping.\n")
            if time.monotonic() - self._looked > _STUCK:  # as in a line that nobody reads
                raise KeyboardInterrupt

        before = {ending_signal: signal.signal(ending_signal, note) for ending_signal in ending_signals()}
        try:
            yield
        finally:
            for ending_signal, handler in before.items():
                signal.signal(ending_signal, handler)


def interruptible(work: Callable[[], Result]) -> Result:
    """Run `work` in a thread and return its result or raise its exception.

    Compiled code does not react to Ctrl-C; the main thread, which only waits, does.
    """
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
        if _asked:
            raise KeyboardInterrupt
        thread.join(0.1)
    if errors:
        raise errors[0]
    return results[0]
