"""Writes a recording in a thread of its own: a disk that blocks, is slow or is full holds up nobody who controls.

Everything that records while it controls uses this one: logs of autopilots and navigation filters, bags of ROS 2.
"""

import queue
import threading
import time
from collections.abc import Callable
from typing import Any, Protocol

FLUSH_PERIOD = 0.5  # s, after which an entry is on the disk, as far as the disk takes it
CAPACITY = 4096  # entries that wait for the disk; later ones are dropped
_DRAIN = 5.0  # s, that the end waits for the disk

_END = object()  # after the last entry


class Recorder(Protocol):
    """A file that is written entry by entry, by one thread only."""

    def write(self, entry: Any) -> None:
        """Add an entry."""

    def flush(self) -> None:
        """Bring what was written to the disk: it can be read after `kill -9`, and after a power cut."""

    def close(self, dropped: int) -> None:
        """Write the end of the file, which says how many entries are missing."""

    def abandon(self) -> None:
        """Close the file without its end; nothing is raised."""


class BackgroundWriter:
    """Gives entries to a recorder, which a thread writes to and flushes every `FLUSH_PERIOD`.

    Args:
        start: makes the recorder; called in the thread.
        capacity: entries that may wait for the disk.

    Attributes:
        dropped: entries so far that found no place.
        failure: why nothing is written any more; "" while all is well.

    Raises:
        Exception: what `start` raises.
    """

    def __init__(self, start: Callable[[], Recorder], capacity: int = CAPACITY):
        self._start = start
        self._entries = queue.Queue[Any](capacity)
        self.dropped, self.failure = 0, ""
        self._refused: list[BaseException] = []
        self._started = threading.Event()
        # A daemon, so that a disk that never answers does not keep the process from its end.
        self._thread = threading.Thread(target=self._run, name="undertow recording", daemon=True)
        self._thread.start()
        self._started.wait()
        if self._refused:
            raise self._refused[0]

    def put(self, entry: Any, patience: float = 0.0) -> None:
        """Let an entry be written, or drop it where `capacity` of them wait already.

        Args:
            entry: is not changed afterwards.
            patience: s, that this may wait for a place; nothing waits by default.
        """
        if self.failure:
            return
        try:
            self._entries.put(entry, block=patience > 0, timeout=max(patience, 0.0))
        except queue.Full:
            self.dropped += 1

    def close(self) -> None:
        """Write what waits and the end of the file, for some seconds at most; `failure` says what went wrong."""
        if self.failure:
            return
        until = time.monotonic() + _DRAIN
        try:
            self._entries.put(_END, timeout=_DRAIN)
        except queue.Full:
            pass
        self._thread.join(max(until - time.monotonic(), 0.0))
        if self._thread.is_alive() and not self.failure:
            self.failure = f"the disk did not answer within {_DRAIN:g} s at the end"

    def missing(self, what: str) -> list[str]:
        """What the recording lacks, as sentences; `what` names the entries, as in `steps`."""
        sentences = [f"{self.failure}; later {what} are not recorded"] if self.failure else []
        return sentences + [f"{self.dropped} {what} are missing: the disk was too slow"] * (self.dropped > 0)

    def _run(self) -> None:
        try:
            recorder = self._start()
        except BaseException as error:
            self._refused.append(error)
            return
        finally:
            self._started.set()
        try:
            self._record(recorder)
        except Exception as error:  # whatever it is, it must not end control
            self.failure = getattr(error, "strerror", None) or str(error) or type(error).__name__
            recorder.abandon()

    def _record(self, recorder: Recorder) -> None:
        """Write entries until the last one; flush those that have waited for a while."""
        due: float | None = None  # when to flush; None where nothing was written since
        while True:
            try:
                entry = self._entries.get(timeout=None if due is None else max(due - time.monotonic(), 0.0))
            except queue.Empty:
                recorder.flush()
                due = None
                continue
            if entry is _END:
                recorder.close(self.dropped)
                return
            recorder.write(entry)
            now = time.monotonic()
            if due is None:
                due = now + FLUSH_PERIOD
            elif now >= due:
                recorder.flush()
                due = None
