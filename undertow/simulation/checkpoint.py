"""Checkpoint of a tuning or another search: every evaluation is written to disk, so that it can be resumed.

The methods are deterministic functions of the evaluations, so a tuning is resumed by running them again: the
evaluations come from the checkpoint as far as it goes. The result is the same as without the interruption, bit for bit.
"""

import contextlib
import json
import os
import time
from collections.abc import Callable
from concurrent.futures import Future
from pathlib import Path
from typing import Any, TypeVar

import numpy as np

from undertow.core.atomic_io import write_whole
from undertow.core.errors import BadInput

Result = TypeVar("Result")

_BETWEEN_WORDS = 10.0  # s, between two lines about something that takes long

_KEYS = ("what", "at", "answer", "elapsed")  # of an evaluation


class OutOfTime(Exception):
    """The budget does not allow another evaluation."""


class Checkpoint:
    """Evaluations in order.

    Args:
        path: the file, with one evaluation per line; the first line identifies the tuning.
        about: identifies the tuning; an earlier checkpoint must have the same.
        budget: s, of all sessions together.
        resume: whether to continue an earlier checkpoint.
        started: `clock()` of the start, so that preparations count; None for now.
        what: is resumed, for messages.
        clock: gives the time, s.

    Raises:
        BadInput: there is nothing to resume, or another tuning; or there is an unfinished tuning without `resume`.
    """

    def __init__(
        self,
        path: Path,
        about: str,
        budget: float,
        resume: bool,
        started: float | None = None,
        what: str = "tuning",
        clock: Callable[[], float] = time.perf_counter,
    ):
        self._path, self._budget, self._clock = path, budget, clock
        self._started = clock() if started is None else started
        self._known = _read(path, about, resume, what)
        self._asked, self._spent = 0, self._known[-1]["elapsed"] if self._known else 0.0
        self._longest: dict[str, float] = {}
        if not self._known:
            write_whole(path, json.dumps({"about": about}) + "\n")

    @property
    def elapsed(self) -> float:
        """Time spent in all sessions, s."""
        if self._asked < len(self._known):
            return self._known[self._asked]["elapsed"]
        return self._spent + self._clock() - self._started

    def wait(self, work: Future[Result], what: str, say: Callable[[str], None]) -> Result:
        """The result of something that cannot be interrupted, such as compiling, in another thread.

        Earlier sessions do not count: what they compiled is lost, and a resumed tuning must come to its evaluations.

        Args:
            work: what is waited for; it goes on alone where the budget ends first.
            what: its name.
            say: called with the name and the time so far, every few seconds.

        Raises:
            OutOfTime: the budget is used up before it is done.
        """
        elapsed = lambda: self._clock() - self._started
        while not work.done() and (remaining := self._budget - elapsed()) > 0:
            with contextlib.suppress(TimeoutError):
                return work.result(timeout=min(_BETWEEN_WORDS, remaining))
            if not work.done():
                say(f"{what}: {elapsed():.0f} s so far")
        if not work.done():
            raise OutOfTime
        return work.result()

    def ask(self, what: str, at: np.ndarray, compute: Callable[[], Any], must: bool = False) -> Any:
        """An evaluation, from the checkpoint or computed and written.

        Args:
            what: kind of evaluation.
            at: its arguments.
            compute: computes it, as JSON can hold it.
            must: whether to compute it even if the budget is used up.

        Raises:
            OutOfTime: it would exceed the budget.
        """
        arguments = np.asarray(at, dtype=float).tolist()
        if self._asked < len(self._known):
            entry = self._known[self._asked]
            if (entry["what"], entry["at"]) != (what, arguments):
                raise BadInput("--resume", "repeat the same steps as before", f"a run with other steps from {what} on")
            self._asked += 1
            return entry["answer"]
        elapsed_before = self.elapsed
        if not must and elapsed_before + self._longest.get(what, 0.0) > self._budget:
            raise OutOfTime
        answer = compute()
        # The first evaluation of a kind is compiled, and says nothing of how long the next one takes.
        self._longest[what] = self.elapsed - elapsed_before if what in self._longest else 0.0
        line = {"what": what, "at": arguments, "answer": answer, "elapsed": self.elapsed}
        with self._path.open("a", encoding="utf-8") as file:
            file.write(json.dumps(line) + "\n")
            file.flush()
            os.fsync(file.fileno())  # faster than any evaluation
        return answer


def has_answers(path: Path) -> bool:
    """Whether a checkpoint holds an evaluation, so that resuming makes sense."""
    try:
        return path.read_bytes().count(b"\n") > 1
    except OSError:
        return False


def _read(path: Path, about: str, resume: bool, what: str) -> list[dict[str, Any]]:
    if not path.exists():
        if resume:
            hint = "Leave --resume out to start one"
            raise BadInput("--resume", f"find an unfinished {what}", f"nothing in {path.parent}", hint=hint)
        return []
    if not resume:
        hint = "Add --resume to continue it, or choose another folder"
        raise BadInput("--out", f"be a folder without an unfinished {what}", str(path.parent), hint=hint)
    try:
        lines = path.read_bytes().decode().splitlines(keepends=True)
        entries = [json.loads(line) for line in lines if line.endswith("\n")]  # the last one may be incomplete
        evaluations = [{key: entry[key] for key in _KEYS} for entry in entries[1:]]
    except (ValueError, KeyError, TypeError) as error:
        hint = "Remove it to start again"
        raise BadInput("--resume", "find a checkpoint that can be read", f"{path}: {error!r}", hint=hint) from None
    if entries[:1] not in ([], [{"about": about}]):  # a process may have been killed while it wrote the first line
        raise BadInput("--resume", "continue with the same scenario and method", "given with others")
    if lines and not lines[-1].endswith("\n"):
        write_whole(path, "".join(lines[:-1]))
    return evaluations
